"""Bones reach the axes of the run below parents that the user moves, and without inheritance."""

import numpy as np

from stage import (
    Quaternion,
    animation,
    bake,
    character,
    check_equal,
    curves,
    new_scene,
    recorded,
    select,
)

new_scene()
rig = character()
rig.data.bones["tip"].use_inherit_rotation = False
run = recorded(rig)
action = rig.animation_data.action
bag = action.layers[0].strips[0].channelbags[0]
for curve in bag.fcurves:  # the user moves the tail after the run
    if "tail" in curve.data_path:
        for point in curve.keyframe_points:
            point.co.y += 0.2
before = animation(rig)[1]
select(rig, "tip")
strip = bake(rig, "SELECTED")
assert len(curves(strip.action)) == 4
after = animation(rig)[1]
assert np.abs(after[:, 1] - before[:, 1]).max() == 0.0
for k, path in enumerate(sorted((run / "states").iterdir())):
    assert np.abs(np.load(path)["body_rotation"][3] - after[k, 2]).max() < 1e-5
rig.data.bones["tip"].use_inherit_rotation = True
run = recorded(
    rig, ("tail",), turns=[Quaternion((0, 0, 1), 0.1 * k) for k in range(12)], called="b"
)
bake(rig)
check_equal(rig, run, ("tail",))
