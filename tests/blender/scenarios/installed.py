"""The extension installs from its zip, and is disabled, enabled and reloaded without a trace."""

from stage import bpy, install_extension, message

NAME = install_extension()
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
