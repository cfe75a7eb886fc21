"""Rotations of bones as Blender keeps them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from blender.motion import (
    Motion,
    MotionError,
    angles,
    axes_only,
    keys_within,
    read_motion,
    same_side,
    turns,
)
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

FRAMES = 30


def some(count: int, seed: int) -> np.ndarray:
    """Rotation matrices."""
    return Rotation.random(count, random_state=seed).as_matrix()


def motion(names: tuple[str, ...], position: np.ndarray, rotation: np.ndarray) -> Motion:
    """A run whose forces are along the y axes of the bones."""
    return Motion(names, names, position, rotation, position, rotation[..., 1])


def test_places_in_the_armature() -> None:
    """World = armature's place, with its scale, times the place in the armature, without one."""
    places, rotation = np.tile(np.eye(4), (FRAMES, 1, 1)), some(FRAMES, 1)
    places[:, :3, :3], places[:, :3, 3] = 2.5 * some(FRAMES, 5), np.arange(FRAMES)[:, None]
    head = np.random.default_rng(6).normal(size=(FRAMES, 3))
    run = motion(("root",), 0.1 * head[:, None], rotation[:, None])
    inner = run.in_armature("root", 0.1, places)
    assert_allclose((places @ inner)[:, :3, 3], head, atol=1e-12)
    assert_allclose((places @ inner)[:, :3, :3], 2.5 * rotation, atol=1e-12)
    assert_allclose(axes_only(places), places[:, :3, :3] / 2.5, atol=1e-12)


def test_angles_between_rotations() -> None:
    """Of 1e-7 degrees to half a turn."""
    exact = np.array([0.0, 1e-7, 1.0, 90.0, 180.0])
    turned = Rotation.from_rotvec(np.outer(np.radians(exact), [0.6, 0.0, 0.8])).as_matrix()
    start = some(5, 2)
    assert_allclose(angles(start, start @ turned), exact, rtol=1e-6)


def test_quaternions_stay_on_one_side() -> None:
    smooth = Rotation.from_rotvec(np.outer(np.linspace(0, 12, 60), [0.6, 0, 0.8]))
    found = same_side(smooth.as_quat(canonical=True, scalar_first=True))
    assert np.abs(np.diff(found, axis=0)).max() < 0.2
    assert_allclose(Rotation.from_quat(found, scalar_first=True).as_matrix(), smooth.as_matrix())


@pytest.mark.parametrize("ends", [(0.0, 12.0), (-2.0, 2.0), (3.0, 3.0)])
def test_angles_and_axes_do_not_jump(ends: tuple[float, float]) -> None:
    """Through rest and half turns; a whole turn more is the same rotation."""
    smooth = Rotation.from_rotvec(np.outer(np.linspace(*ends, 60), [0.6, 0.0, 0.8]))
    found = turns(smooth.as_quat(canonical=True, scalar_first=True))
    assert np.abs(np.diff(found[:, 0])).max() < 0.25
    away = np.linalg.norm(smooth.as_rotvec(), axis=1) > 1e-6
    assert np.abs(np.diff(found[away, 1:], axis=0)).max() < 1e-6
    same = Rotation.from_rotvec(found[:, :1] * found[:, 1:])
    assert_allclose(same.as_matrix(), smooth.as_matrix(), atol=1e-9)


def test_a_run_without_frames_is_told(tmp_path: Path) -> None:
    with pytest.raises(MotionError, match="has no frames to bake"):
        read_motion(tmp_path)
    (tmp_path / "model.json").write_text(json.dumps({"bodies": ["world"], "joints": []}))
    with pytest.raises(MotionError, match="it has no states"):
        read_motion(tmp_path)
    (tmp_path / "states").mkdir()
    (tmp_path / "states" / "000000.npz").write_bytes(b"cut")
    with pytest.raises(MotionError, match="has no frames to bake"):
        read_motion(tmp_path)


def test_keys_within_a_tolerance_are_few() -> None:
    """A quarter turn at constant rate and a rest need few keys."""
    angles = np.radians([*np.linspace(0.0, 90.0, FRAMES), *[90.0] * FRAMES])
    values = np.stack([np.cos(angles / 2), np.sin(angles / 2), 0 * angles, 0 * angles], axis=1)

    def unit(found: np.ndarray) -> np.ndarray:
        return found / np.linalg.norm(found, axis=1, keepdims=True)

    kept = keys_within(values, unit, 1.0)
    assert {0, FRAMES - 1, 2 * FRAMES - 1} <= {*kept}
    assert len(kept) < 10
    linear = [np.interp(np.arange(2 * FRAMES), kept, column[kept]) for column in values.T]
    cosines = np.sum(unit(np.stack(linear, axis=1)) * values, axis=1)
    assert np.degrees(2.0 * np.arccos(np.minimum(cosines, 1.0))).max() <= 1.0


def test_the_last_round_is_moved_to_the_first() -> None:
    """Each round of a cycle moves and turns the character on; a tail differs by 10 degrees."""
    stride, shift_of = Rotation.from_euler("z", 30, degrees=True).as_matrix(), (1.0, 2.0, 0.0)
    rotation, position = some(8, 4).reshape(4, 2, 3, 3), np.ones((4, 2, 3))
    rotation = np.concatenate([rotation, stride @ rotation])
    position = np.concatenate([position, position @ stride.T + shift_of])
    rotation[7, 1] = rotation[7, 0] @ rotation[4, 0].T @ rotation[4, 1]
    rotation[7, 1] = rotation[7, 1] @ Rotation.from_euler("y", 10, degrees=True).as_matrix()
    run = motion(("root", "tail"), position, rotation)
    last = run.after(4, loop=True)
    assert_allclose(last.rotation[:3], run.rotation[:3], atol=1e-12)
    assert_allclose(last.position, run.position[:4], atol=1e-12)
    assert_allclose(last.centre, run.centre[:4], atol=1e-12)
    assert_allclose(last.force[:3], run.force[:3], atol=1e-12)
    assert last.ends_apart(["root", "tail"]) == pytest.approx(10.0)
    assert_allclose(run.after(4, loop=False).rotation, run.rotation[4:])
    with pytest.raises(MotionError, match="the run has 7 frames, and the bake starts after 8"):
        run.after(8, loop=False)
