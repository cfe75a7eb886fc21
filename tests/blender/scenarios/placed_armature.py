"""An armature that is moved, turned, scaled and carried by an animated parent."""

from stage import bake, bpy, character, check_equal, new_scene, place, recorded

scene = new_scene()
rig = character()
place(rig)
carrier = bpy.data.objects.new("carrier", None)
scene.collection.objects.link(carrier)
for frame, x in ((1, 0.0), (12, 4.0)):
    carrier.location, carrier.rotation_euler = (x, 0.0, 1.0), (0.0, 0.2 * x, 0.0)
    carrier.keyframe_insert("location", frame=frame)
    carrier.keyframe_insert("rotation_euler", frame=frame)
rig.parent = carrier
run = recorded(rig)
bake(rig, "ALL")
check_equal(rig, run, ("trunk", "tail", "tip"))
