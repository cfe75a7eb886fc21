"""A run is found again after the file is saved, moved with its folder, and opened."""

import shutil

from stage import FOLDER, bake, bpy, character, check_equal, new_scene, recorded

new_scene()
rig = character()
run = recorded(rig)
rig.flowborne.folder = "//job"
rig.flowborne.strength = 0.5
bpy.ops.wm.save_mainfile()
moved = FOLDER / "moved"
moved.mkdir()
shutil.copy(FOLDER / "shot.blend", moved)
shutil.move(FOLDER / "job", moved / "job")
bpy.ops.wm.open_mainfile(filepath=str(moved / "shot.blend"))
rig = bpy.data.objects["rig"]
assert abs(rig.flowborne.strength - 0.5) < 1e-6
bake(rig)
check_equal(rig, moved / "job" / "run", ("tail", "tip"))
bpy.ops.wm.save_mainfile()
bpy.ops.wm.open_mainfile(filepath=str(moved / "shot.blend"))
check_equal(bpy.data.objects["rig"], moved / "job" / "run", ("tail", "tip"))
