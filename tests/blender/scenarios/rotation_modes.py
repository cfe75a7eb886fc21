"""Bones keep their rotation mode, and no key jumps, also through half turns and gimbal lock."""

import math

import numpy as np

from stage import Quaternion, bake, character, check_equal, curves, new_scene, path_of, recorded

MODES = ("QUATERNION", "AXIS_ANGLE", "XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX")
STEP = math.pi / 9.0

for number, mode in enumerate(MODES):
    scene = new_scene(1, 40)
    rig = character(f"rig {mode}", (mode, mode, "QUATERNION"))
    about = [Quaternion(axis, STEP * k) for axis in ((1, 0, 0), (0, 1, 0)) for k in range(20)]
    run = recorded(rig, ("tail",), turns=about, called=f"job-{number}")
    strip = bake(rig)
    bone = rig.pose.bones["tail"]
    assert bone.rotation_mode == mode
    check_equal(rig, run, ("tail",))
    rotations = {path for path, _ in curves(strip.action)}
    assert rotations == {f'pose.bones["tail"].{path_of(bone)}'}
    keys = np.array([[value for _, value in keys] for keys in curves(strip.action).values()])
    jumps = np.abs(np.diff(keys, axis=1))
    jumps = np.delete(jumps, 19, axis=1)  # there the axis changes by a quarter turn
    if mode == "AXIS_ANGLE":
        assert jumps[0].max() < 1.01 * STEP, jumps.max()
    elif mode == "QUATERNION":
        assert jumps.max() < STEP
    else:  # at gimbal lock two of the angles may jump by half a turn, and not by a whole one
        assert jumps.max() < math.pi + STEP, (mode, jumps.max())
