"""Thinned keys stay within the tolerance in every frame and mode, with fewer keys."""

import math

import numpy as np

from stage import BONES, animation, bake, bpy, character, curves, new_scene, recorded, swing

MODES = ("QUATERNION", "AXIS_ANGLE", "ZXY")
TOLERANCE = 0.5

new_scene(5, 64)
rig = character(modes=MODES)
parts = [swing(15, 0.8), swing(1) * 20, swing(25, 0.1)]
recorded(rig, turns=[turn for part in parts for turn in part])
bake(rig, "ALL")
every = curves(rig.animation_data.nla_tracks[-1].strips[0].action)
exact = animation(rig)[1]
bpy.ops.flowborne.bake(bones="ALL", thin=math.radians(TOLERANCE))
thinned = animation(rig)[1]
fewer = curves(rig.animation_data.nla_tracks[-1].strips[0].action)


def relative(rotation):
    """Rotations of bones relative to their parents (frames, n, 3, 3)."""
    return np.concatenate(
        [rotation[:, :1], np.swapaxes(rotation[:, :-1], -1, -2) @ rotation[:, 1:]], axis=1
    )


between = np.swapaxes(relative(exact), -1, -2) @ relative(thinned)
cosines = (np.trace(between, axis1=-2, axis2=-1) - 1.0) / 2.0
apart = np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0)))
assert 0.05 < apart.max() < TOLERANCE + 1e-2, apart.max(axis=0)
assert fewer.keys() == every.keys()
for (path, _), keys in fewer.items():
    assert (keys[0][0], keys[-1][0]) == (5.0, 64.0)
    if path.endswith("location"):
        assert len(keys) == 60
    elif BONES[0] not in path:
        assert len(keys) < 50, (path, len(keys))
