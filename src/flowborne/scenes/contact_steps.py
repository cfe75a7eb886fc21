"""How many steps a frame has by default, where bodies can touch a floor."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from flowborne.scenes.bodies import load_model
from flowborne.scenes.schema import Scene
from flowborne.solids.geoms import floors
from flowborne.solids.model import SolidModel


def with_steps(scene: Scene) -> Scene:
    """The scene with so many steps a frame that contact with a floor is stiff, or those it gives.

    A contact of MuJoCo is a critically damped spring with the time constant of `solref`, and a step
    of more than half of that softens it (`refsafe`): of a humanoid on one step of 42 ms the feet
    rest 12 mm deep, on five 0.8 mm. Where `solref` is a stiffness, the file's timestep counts.
    """
    if "steps_per_frame" in scene.time.model_fields_set or scene.model_path is None:
        return scene
    longest = longest_step(load_model(scene))
    steps = max(1, math.ceil(scene.frame_time / longest * (1.0 - 1e-9)))
    if steps == scene.time.steps_per_frame:
        return scene
    time = scene.time.model_copy(update={"steps_per_frame": steps})
    return scene.model_copy(update={"time": time})


def longest_step(model: SolidModel) -> float:
    """s, for which contacts of moving bodies with planes and height fields are stiff."""
    mj = model.mj
    moving = np.flatnonzero(model.moving[mj.geom_bodyid]).tolist()
    longest = np.inf
    for floor in floors(mj):
        for geom in moving:
            if _collide(mj.geom_contype, mj.geom_conaffinity, floor, geom):
                constant = mj.geom_solref[[floor, geom], 0].min()
                step = 0.5 * constant if constant > 0.0 else mj.opt.timestep
                longest = min(longest, step)
    return longest


def _collide(types: NDArray[np.int32], affinities: NDArray[np.int32], one: int, other: int) -> bool:
    return bool(types[one] & affinities[other] or types[other] & affinities[one])
