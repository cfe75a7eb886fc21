"""Soles that stand are on the floor, whatever the floor of the capture was."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flowborne.motion.clip import Clip
from flowborne.motion.human.gait import gait_clip
from flowborne.motion.human.skeleton import SIDES, standard_skeleton
from flowborne.motion.human.soles import MAX_FLOOR_RANGE, STANDING_SPEED, with_soles_on_floor
from flowborne.scenes.build import build
from flowborne.scenes.load import load_scene
from flowborne.solids.dynamics import kinematics
from flowborne.solids.model import SolidModel

MOCAP = Path(__file__).parents[4] / "shared" / "mocap"
WALK = gait_clip(standard_skeleton())
SAME = {joint: joint for joint in WALK.names}
MASS = 75.0


def several(cycles: int) -> Clip:
    """The walk, again and again, from where it has come to."""
    step = WALK.translation[-1] - WALK.translation[0]
    places = [WALK.translation[:-1] + n * step for n in range(cycles)]
    turns = [WALK.rotations[:-1]] * cycles
    return replace(WALK, rotations=np.concatenate(turns), translation=np.concatenate(places))


def raised(clip: Clip, heights: np.ndarray) -> Clip:
    translation = clip.translation.copy()
    translation[:, 2] += heights
    return replace(clip, translation=translation)


def put(clip: Clip) -> Clip:
    return with_soles_on_floor(clip, SAME, standard_skeleton(), MASS, "male")


@pytest.mark.parametrize("height", [0.0, -0.9, 3.0])
def test_a_walk_on_any_level_floor_comes_back(height: float) -> None:
    clip = several(3)
    back = put(raised(clip, height))
    np.testing.assert_allclose(back.translation, clip.translation, atol=3e-3)
    np.testing.assert_array_equal(back.rotations, clip.rotations)


def test_a_floor_that_slopes_is_made_level() -> None:
    clip = several(4)
    slope = 0.08 * np.linspace(0.0, 1.0, clip.frames)
    back = put(raised(clip, slope))
    assert np.abs(back.translation[:, 2] - clip.translation[:, 2]).max() < 0.012


def test_stairs_stay_stairs() -> None:
    clip = several(4)
    climb = 4.0 * MAX_FLOOR_RANGE * np.linspace(0.0, 1.0, clip.frames)
    back = put(raised(clip, climb))
    np.testing.assert_allclose(
        np.diff(back.translation[:, 2] - clip.translation[:, 2] - climb), 0.0, atol=1e-12
    )


def test_who_never_stands_is_left_where_he_is() -> None:
    clip = several(1)
    falling = raised(clip, -2.0 * STANDING_SPEED * clip.frame_time * np.arange(clip.frames) * 5.0)
    assert put(falling) is falling


CAPTURES = {"02_01.bvh": 0.056444, "131_01_metres.bvh": 1.0}


def lowest(model: SolidModel, q: np.ndarray, side: str) -> np.ndarray:
    """(3,) m, the lowest corner of a foot and its toes."""
    pose, corners = kinematics(model, q), []
    for body in (f"{side}_foot", f"{side}_toes"):
        geom = model.geom_names.index(body)
        signs = np.sign(np.indices((2, 2, 2)).reshape(3, -1).T - 0.5)
        arms = signs * model.mj.geom_size[model.geom_id[geom]]
        corners.append(pose.geom_position[geom] + arms @ pose.geom_rotation[geom].T)
    found = np.concatenate(corners)
    return np.asarray(found[found[:, 2].argmin()])


@pytest.mark.parametrize("name", CAPTURES)
def test_feet_of_a_capture_stand_on_the_ground_of_its_scene(name: str) -> None:
    if not MOCAP.is_dir():
        pytest.skip("the captures are not here")
    keys = {"clip.file": str(MOCAP / name), "clip.unit": str(CAPTURES[name]), "clip.skip": "1"}
    standing = {}
    for floor in ("file", "soles"):
        world = build(load_scene("human-gravity-back", keys | {"clip.floor": floor})).world
        model, (motion,) = world.setup.solid, world.setup.motions[:1]
        q, dt = world.solid.q.copy(), 1.0 / 60.0
        places = motion_places(model, motion, q, dt)
        speed = np.linalg.norm(places[:, 2:] - places[:, :-2], axis=-1) / (2.0 * dt)
        standing[floor] = places[:, 1:-1, 2][speed < STANDING_SPEED]
    before, after = (np.percentile(standing[floor], (5.0, 95.0)) for floor in ("file", "soles"))
    assert np.abs(before).max() > 0.03
    assert np.abs(after).max() < 0.015


def motion_places(model: SolidModel, motion, q: np.ndarray, dt: float) -> np.ndarray:
    """(2, times, 3) m, the lowest place of each foot."""
    found = []
    for time in np.arange(0.0, motion.length, dt):
        q[model.indices_of(motion.dofs)] = motion.position(time)
        found.append([lowest(model, q, side) for side in SIDES])
    return np.swapaxes(np.array(found), 0, 1)
