"""A shot from 101 is baked from 101, and nothing is changed outside of it."""

from stage import bake, character, check_equal, curves, new_scene, recorded

scene = new_scene(101, 112)
rig = character()
scene.frame_set(90)
before = rig.pose.bones["tail"].matrix.copy()
run = recorded(rig)
strip = bake(rig)
assert (strip.frame_start, strip.frame_end) == (101.0, 112.0)
assert all(keys[0][0] == 101.0 and len(keys) == 12 for keys in curves(strip.action).values())
check_equal(rig, run, ("tail", "tip"))
scene.frame_set(90)
assert rig.pose.bones["tail"].matrix == before
