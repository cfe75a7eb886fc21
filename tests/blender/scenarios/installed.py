"""The extension installs from its zip, and is disabled, enabled and reloaded without a trace."""

import os
import subprocess
import sys
from pathlib import Path

import blender
from stage import FOLDER, bpy, message

NAME = "bl_ext.user_default.flowborne"

(builder,) = Path(bpy.utils.system_resource("SCRIPTS")).rglob("blender_ext.py")
source, archive = Path(blender.__file__).parent, FOLDER / "flowborne.zip"
for command in (
    ("build", "--source-dir", source, "--output-filepath", archive),
    ("validate", archive),
):
    subprocess.run([sys.executable, builder, *command], check=True)
assert Path(bpy.utils.user_resource("EXTENSIONS")).is_relative_to(
    os.environ["BLENDER_USER_RESOURCES"]
)
bpy.ops.extensions.package_install_files(
    filepath=str(archive), repo="user_default", enable_on_install=True
)
assert NAME in bpy.context.preferences.addons
assert hasattr(bpy.types.Object, "flowborne")
bpy.context.preferences.addons[NAME].preferences.engine = "/nowhere"
bpy.ops.mesh.primitive_cube_add()
for _ in range(2):
    bpy.ops.preferences.addon_disable(module=NAME)
    assert not hasattr(bpy.types.Object, "flowborne")
    assert not hasattr(bpy.types, "FLOWBORNE_PT_panel")
    bpy.ops.preferences.addon_enable(module=NAME)
    assert hasattr(bpy.types, "FLOWBORNE_PT_panel")
bpy.utils.load_scripts(reload_scripts=True)
assert hasattr(bpy.types, "FLOWBORNE_PT_panel")
bpy.ops.object.armature_add()
assert "there is no flowborne in" in message(RuntimeError, bpy.ops.flowborne.run)
