"""How many steps a frame has by default, where bodies can touch a floor."""

from __future__ import annotations

import math

import mujoco
import numpy as np
from numpy.typing import NDArray

from flowborne.scenes.bodies import load_model, spec_of
from flowborne.scenes.schema import Scene
from flowborne.solids.geoms import CONTACT_ONLY, kind_of
from flowborne.solids.model import SolidModel


def with_steps(scene: Scene) -> Scene:
    """The scene with so many steps a frame that contact with a floor is stiff, or those it gives.

    A contact of MuJoCo is a critically damped spring with the time constant of `solref`, and a step
    of more than half of that softens it (`refsafe`): of a humanoid on one step of 42 ms the feet
    rest 12 mm deep, on five 0.8 mm. Where `solref` is a stiffness, the file's timestep counts.
    """
    if "steps_per_frame" in scene.time.model_fields_set or scene.model_path is None:
        return scene
    if not has_floors(spec_of(scene)):
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
    moving = [g for g in range(mj.ngeom) if model.moves[mj.geom_bodyid[g]].any()]
    floors = [g for g in range(mj.ngeom) if kind_of(mj, g) in CONTACT_ONLY]
    longest = np.inf
    for floor in floors:
        for geom in moving:
            if _collide(mj.geom_contype, mj.geom_conaffinity, floor, geom):
                constant = mj.geom_solref[[floor, geom], 0].min()
                step = 0.5 * constant if constant > 0.0 else mj.opt.timestep
                longest = min(longest, step)
    return longest


def has_floors(spec: mujoco.MjSpec) -> bool:
    """Whether a model has planes or height fields, which is seen without compiling it."""
    floors = mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD
    return any(geom.type in floors for geom in spec.geoms)


def _collide(types: NDArray[np.int32], affinities: NDArray[np.int32], one: int, other: int) -> bool:
    return bool(types[one] & affinities[other] or types[other] & affinities[one])
