"""A bake is an action and a slot of its own on the NLA; that of the user keeps its keys."""

import bpy
import numpy as np

from stage import animation, bake, character, curves, new_scene, recorded

scene = new_scene()
rig = character()
action, slot = rig.animation_data.action, rig.animation_data.action_slot
keys, before = curves(action), animation(rig)
recorded(rig)
strip = bake(rig)
assert strip.action not in (action, None)
assert strip.action_slot.identifier == f"OB{rig.name}"
assert strip.action_slot != slot
assert {path for path, _ in curves(strip.action)} == {
    f'pose.bones["{bone}"].rotation_quaternion' for bone in ("tail", "tip")
}
assert curves(action) == keys
below = rig.animation_data.nla_tracks[0].strips[0]
assert (below.action, below.action_slot) == (action, slot)
assert rig.animation_data.action is None
assert len(bpy.data.actions) == 2

# without the bake the armature moves as before, in the range of the scene and out of it
rig.animation_data.nla_tracks[-1].mute = True
after = animation(rig)
assert all(np.array_equal(a, b) for a, b in zip(before, after, strict=True))
rig.animation_data.nla_tracks[-1].mute = False
scene.frame_set(scene.frame_end + 5)
assert abs(rig.pose.bones["tail"].rotation_quaternion.z) > 0.1
