"""Two characters have settings, runs and bakes of their own, and a file has one of them."""

from pathlib import Path

from blender.character import export_character, meshes_of

from stage import FOLDER, bake, bpy, character, check_equal, new_scene, recorded, swing

new_scene()
first, second = character("first"), character("second")
second.location.x = 5.0
bpy.context.view_layer.update()
runs = recorded(first), recorded(second, turns=swing(12, -0.5), called="other")
first.flowborne.medium = "WATER"
assert second.flowborne.medium == "AIR"
for rig, run in zip((first, second), runs, strict=True):
    bake(rig)
    check_equal(rig, run, ("tail", "tip"))
check_equal(first, runs[0], ("tail", "tip"))
assert [mesh.name for mesh in meshes_of(bpy.context, second)] == ["second body"]
export_character(bpy.context, second, FOLDER / "c.glb", 1, 12)
content = Path(FOLDER / "c.glb").read_bytes()
assert b'"second body' in content
assert b'"first' not in content
