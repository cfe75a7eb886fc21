"""The strip's influence blends from the animation to the run."""

import numpy as np

from stage import animation, bake, character, new_scene, recorded

new_scene()
rig = character()
before = animation(rig)[1]
recorded(rig)
strip = bake(rig)
whole = animation(rig)[1]
strip.use_animated_influence = True
for influence in (0.0, 0.5, 1.0):
    strip.influence = influence
    strip.fcurves[0].keyframe_points.insert(1, influence)
    found = animation(rig)[1]
    to_before, to_whole = (np.abs(found - other).max() for other in (before, whole))
    if influence == 0.0:
        assert to_before < 1e-6
    elif influence == 1.0:
        assert to_whole < 1e-6
    else:
        assert min(to_before, to_whole) > 0.1
