"""BVH out: what was not touched comes back, what was replaced says the rotation it was given."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from numpy.testing import assert_allclose

from flowborne.base.errors import SceneError
from flowborne.motion import bvh
from flowborne.motion.bvh import write_bvh, write_clip
from flowborne.motion.bvh_file import load_bvh
from flowborne.motion.clip import Clip
from flowborne.motion.quaternions import about, angle, inverse, product

from ..read_bvh import read_bvh
from .bvh_texts import CHAIN, Written, written

MOCAP = Path(__file__).parents[3] / "shared" / "mocap"

in_one_folder = settings(
    max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "clip.bvh"


def own_rotations(clip: Clip) -> dict[str, np.ndarray]:
    return {name: clip.rotations[:, joint] for joint, name in enumerate(clip.names)}


def largest_difference(first: Clip, second: Clip) -> float:
    """rad, of any joint's rotation."""
    return float(angle(product(inverse(first.rotations), second.rotations)).max())


@in_one_folder
@given(written())
def test_untouched_clip_comes_back_also_through_quaternions(path: Path, file: Written) -> None:
    path.write_bytes(file.raw)
    source, out = load_bvh(path), path.with_name("out.bvh")
    for rotations in ({}, own_rotations(read_bvh(path))):
        write_bvh(out, path, rotations)
        back = load_bvh(out)
        assert back.hierarchy == source.hierarchy
        assert back.time_text == source.time_text
        assert_allclose(back.values, source.values, atol=1e-6)


@in_one_folder
@given(written(full=True))
def test_angles_are_found_anew_for_every_order_of_channels(path: Path, file: Written) -> None:
    path.write_bytes(file.raw)
    clip, out = read_bvh(path), path.with_name("out.bvh")
    turn = about(np.array([0.6, 0.0, 0.8]), np.array(0.3))
    wanted = {name: product(turn, rotation) for name, rotation in own_rotations(clip).items()}
    write_bvh(out, path, wanted)
    found = own_rotations(read_bvh(out))
    for name in clip.names:
        assert np.rad2deg(angle(product(inverse(wanted[name]), found[name]))).max() < 1e-4
    assert_allclose(read_bvh(out).translation, clip.translation, atol=1e-9)


def test_only_the_joint_and_the_range_that_are_asked_for_change(path: Path) -> None:
    path.write_bytes(CHAIN.replace("\n", "\r\n").replace("0.1 9 1", "1e-1 9.000 1").encode())
    out = path.with_name("out.bvh")
    turned = about(np.array([0.0, 0.0, 1.0]), np.array([0.5, 0.6]))
    write_bvh(out, path, {"Left Knee": turned}, first=1)
    head, rows = out.read_bytes().decode().split("Frame Time: 0.0083333\n")
    assert head == CHAIN.split("Frames")[0].replace("\n", "\r\n") + "Frames: 2\n"
    first, second = (row.split() for row in rows.splitlines())
    assert first[:6] == ["1e-1", "9.000", "1", "0", "0", "45"]
    assert second[:6] == ["0.2", "9", "1", "0", "0", "90"]
    # about the vertical, which is Yrotation of a file that is y up
    assert_allclose(np.array(first[6:], float), [0.0, np.rad2deg(0.5), 0.0], atol=1e-5)
    assert_allclose(read_bvh(out).rotations[:, 1], turned, atol=1e-7)


def test_replaced_angles_go_on_without_a_full_turn(path: Path) -> None:
    frames = 200
    rows = "\n".join("0 9 1 0 0 0 370 20 30" for _ in range(frames))
    text = CHAIN[: CHAIN.index("Frames")]
    path.write_text(f"{text}Frames: {frames}\nFrame Time: 0.01\n{rows}\n")
    clip, out = read_bvh(path), path.with_name("out.bvh")
    steady = product(
        about(np.array([1.0, 0.0, 0.0]), np.linspace(0.001, 12.0, frames)), clip.rotations[:, 1]
    )
    write_bvh(out, path, {"Left Knee": steady})
    angles = load_bvh(out).values[:, 6:]
    assert_allclose(angles[0], [370.0, 20.0, 30.0], atol=0.1)  # though 10 degrees are the same
    assert np.abs(np.diff(angles, axis=0)).max() < 5.0
    assert angles[-1, 0] == pytest.approx(370.0 + np.rad2deg(12.0), abs=1e-5)


def test_turn_that_the_channels_cannot_say_is_refused(path: Path) -> None:
    path.write_text(
        CHAIN.replace("3 Zrotation Yrotation Xrotation", "1 Yrotation")
        .replace("10 20 30", "10")
        .replace("11 21 31", "11")
        .replace("12 22 32", "12")
    )
    out = path.with_name("out.bvh")
    upright = about(np.array([0.0, 0.0, 1.0]), np.deg2rad([50.0, 60.0, 400.0]))
    write_bvh(out, path, {"Left Knee": upright})
    assert_allclose(load_bvh(out).values[:, 6], [50.0, 60.0, 40.0], atol=1e-5)
    out.unlink()
    tilted = product(about(np.array([1.0, 0.0, 0.0]), np.array(0.1)), upright)
    with pytest.raises(
        SceneError, match=r"line 6: joint 'Left Knee' has 1 rotation .* turns 4.96 deg"
    ):
        write_bvh(out, path, {"Left Knee": tilted})
    assert not out.exists()


def test_joint_or_frames_that_are_not_there(path: Path) -> None:
    path.write_text(CHAIN)
    with pytest.raises(SceneError, match=r"no joint 'Knee'\. It has: Hips, Left Knee"):
        write_bvh(path, path, {"Knee": np.ones((3, 4))})
    with pytest.raises(SceneError, match="has 3 frames, none of them from 3 to None"):
        write_bvh(path, path, {}, first=3)
    with pytest.raises(ValueError, match="not the shape"):
        write_bvh(path, path, {"Hips": np.ones((2, 4))})


@in_one_folder
@given(written())
def test_clip_without_a_file_is_written_in_any_unit(path: Path, file: Written) -> None:
    path.write_bytes(file.raw)
    clip = read_bvh(path, unit=0.01)
    write_clip(path, clip, unit=0.001)
    back = read_bvh(path, unit=0.001)
    assert back.names == clip.names
    assert back.parents.tolist() == clip.parents.tolist()
    assert back.frame_time == clip.frame_time
    assert back.ends.keys() == clip.ends.keys()
    assert_allclose(back.offsets, clip.offsets, atol=1e-9)
    assert_allclose(back.translation, clip.translation, atol=1e-9)
    assert np.rad2deg(largest_difference(clip, back)) < 1e-4


@pytest.mark.skipif(not MOCAP.is_dir(), reason="the real clips are not here")
@pytest.mark.parametrize("name", ["02_01.bvh", "131_01.bvh"])
def test_real_clip_through_angles_found_anew(
    path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    clip = read_bvh(MOCAP / name)
    write_bvh(path, MOCAP / name, own_rotations(clip))
    assert_allclose(load_bvh(path).values, load_bvh(MOCAP / name).values, atol=1e-12)
    monkeypatch.setattr(bvh, "MIN_ROTATION_CHANGE", -1.0)  # no frame keeps its own numbers
    write_bvh(path, MOCAP / name, own_rotations(clip))
    assert np.rad2deg(largest_difference(clip, read_bvh(path))) < 1e-4


def test_no_bone_of_zero_length_is_written(path: Path) -> None:
    """A last bone without an end goes straight on, as long as the nearest one above with a length;
    one that has an end keeps it."""
    offsets = np.array([[0.0, 0.0, 0.0], [0.2, 0.0, 0.1], [0.0, 0.0, 0.0], [0.0, 0.3, 0.0]])
    still = np.tile([1.0, 0.0, 0.0, 0.0], (1, 4, 1))
    clip = Clip(
        ("hip", "knee", "foot", "hand"),
        np.array([-1, 0, 1, 0]),
        offsets,
        {"foot": np.zeros(3), "hand": np.array([0.0, 0.1, 0.0])},
        0.1,
        still,
        np.zeros((1, 3)),
    )
    write_clip(path, clip, 0.01)
    ends = read_bvh(path, 0.01).ends
    assert_allclose(ends["foot"], offsets[1], atol=1e-9)
    assert_allclose(ends["hand"], clip.ends["hand"], atol=1e-9)
    lone = Clip(
        ("ball",), np.array([-1]), np.zeros((1, 3)), {}, 0.1, still[:, :1], np.zeros((1, 3))
    )
    write_clip(path, lone, 0.01)
    assert np.linalg.norm(read_bvh(path, 0.01).ends["ball"]) > 0.0
