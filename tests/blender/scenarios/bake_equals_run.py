"""Free bones are in every frame as in the run, and the others as they were animated."""

import numpy as np

from stage import animation, bake, character, check_equal, new_scene, recorded

new_scene()
rig = character()
before = animation(rig)
run = recorded(rig)
bake(rig)
check_equal(rig, run, ("trunk", "tail", "tip"))
position, rotation = animation(rig)
assert np.abs(rotation[:, 0] - before[1][:, 0]).max() == 0.0
assert np.abs(rotation[:, 1] - before[1][:, 1]).max() > 0.1
