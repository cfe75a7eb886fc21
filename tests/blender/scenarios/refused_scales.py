"""Armatures with a negative or uneven scale are refused, and nothing is changed."""

from stage import bpy, character, new_scene, recorded, refusal

new_scene()
rig = character()
recorded(rig)
for scale, said in (
    ((-1.0, 1.0, 1.0), "has a negative scale, or none: apply it"),
    ((0.0, 1.0, 1.0), "has a negative scale, or none: apply it"),
    ((1.0, 2.0, 1.0), "has the scale 1, 2, 1: apply it"),
):
    rig.scale = scale
    bpy.context.view_layer.update()
    assert said in refusal(rig), refusal(rig)
assert len(bpy.data.actions) == 1
assert not rig.animation_data.nla_tracks
