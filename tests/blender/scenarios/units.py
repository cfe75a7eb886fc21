"""A scene in centimetres: metres of the run are a hundred units, and gravity is in m/s^2."""

from blender.character import reaction_of

from stage import bake, bpy, character, check_equal, new_scene, recorded, select

scene = new_scene()
scene.unit_settings.scale_length = 0.01
scene.gravity = 0.0, 0.0, -981.0
rig = character()
run = recorded(rig, unit=0.01)
bake(rig, "ALL")
check_equal(rig, run, ("trunk", "tail", "tip"), unit=0.01)
select(rig, "tail")
reaction = reaction_of(bpy.context, rig, rig.flowborne)
assert reaction.unit == scene.unit_settings.scale_length
assert abs(reaction.gravity[2] + 9.81) < 1e-5
scene.use_gravity = False
assert reaction_of(bpy.context, rig, rig.flowborne).gravity == (0.0, 0.0, 0.0)
