"""A floating root is baked with the free bones, in place and rotation; it need not be named."""

from dataclasses import replace

import numpy as np
from blender.reaction import Reaction

from stage import animation, bake, character, check_equal, curves, new_scene, place, recorded

new_scene()
rig = character()
place(rig)
run = recorded(rig, ("tail", "tip"))
before = animation(rig)[0]
for k, path in enumerate(sorted((run / "states").iterdir())):  # all of it sinks in the run
    with np.load(path) as state:
        arrays = dict(state)
    arrays["body_position"][1:, 2] -= 0.1 * k
    np.savez(path, **arrays)
file = run.parent / "job.json"
replace(Reaction.load(file), floats=True).save(file)
strip = bake(rig)
assert {path.split('"')[1] for path, _ in curves(strip.action)} == {"trunk", "tail", "tip"}
check_equal(rig, run, ("trunk", "tail", "tip"))
after = animation(rig)[0]
assert np.abs(after[:, 0, 2] - before[:, 0, 2] + 0.1 * np.arange(len(after))).max() < 1e-5
