"""Passes: what one run decided is the constraint of the next (`[earlier]`)."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flowborne.base.errors import SceneError
from flowborne.cli import main as cli
from flowborne.kernels.arrays import Array
from flowborne.motion.quaternions import inverse, product
from flowborne.scenes.bodies import trajectories_of
from flowborne.scenes.build import build
from flowborne.scenes.earlier import TIME, earlier_of
from flowborne.scenes.load import load_scene
from flowborne.scenes.notes import notes_of

from ..made_runs import numbers, run

Write = Callable[..., Path]

MODEL = """
<mujoco>
  <worldbody>
    <body name="arm">
      <joint name="shoulder" type="hinge" axis="0 0 1"/>
      <geom name="arm" type="box" size="0.2 0.05 0.05" pos="0.2 0 0"/>
      <body name="hand" pos="0.4 0 0">
        <joint name="wrist" type="hinge" axis="0 0 1"/>
        <geom name="hand" type="box" size="0.2 0.05 0.05" pos="0.2 0 0"/>
      </body>
    </body>
    <body name="slider" pos="0 1 0">
      <joint name="rail" type="slide" axis="1 0 0"/>
      <geom name="slider" type="sphere" size="0.1"/>
    </body>
    <body name="eye" pos="0 2 0">
      <joint name="gaze" type="ball"/>
      <geom name="eye" type="sphere" size="0.1"/>
    </body>
    <body name="float" pos="0 3 0">
      <freejoint name="drift"/>
      <geom name="float" type="sphere" size="0.1"/>
    </body>
  </worldbody>
</mujoco>
"""

SCENE = """
gravity = [0.0, -9.81, 0.0]

[time]
frames = 6
frames_per_second = 24.0

[solids]
model = "arm.xml"
density = 1000.0
"""

CONTROL = """
[[control]]
joints = ["{joint}"]
strength = 60.0
probe = 1.0
"""

EFFORT = """
[[objectives]]
kind = "effort"
"""


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Writes a scene of the arm with one controlled joint, and what else it says."""

    def write(name: str, joint: str, append: str = "") -> Path:
        (tmp_path / "arm.xml").write_text(MODEL)
        path = tmp_path / f"{name}.toml"
        path.write_text(SCENE + CONTROL.format(joint=joint) + EFFORT + append)
        return path

    return write


@pytest.fixture
def first(write: Write, tmp_path: Path) -> Path:
    """Folder of a run that decided about the shoulder."""
    run(write("first", "shoulder"), tmp_path / "first")
    return tmp_path / "first"


def angles(folder: Path, joint: str) -> Array:
    """(frames + 1,) rad."""
    place = json.loads((folder / "model.json").read_text())["places"][joint][0]
    return np.array([np.load(path)["q"][place] for path in sorted((folder / "states").iterdir())])


def earlier(table: str) -> str:
    return f"[earlier]\nrun = {table}\n"


def test_a_pass_keeps_what_the_one_before_it_decided(
    first: Path, write: Write, tmp_path: Path
) -> None:
    run(write("second", "wrist", earlier('"first"')), tmp_path / "second")
    decided = angles(first, "shoulder")
    assert np.ptp(decided) > 0.05
    np.testing.assert_allclose(angles(tmp_path / "second", "shoulder"), decided, atol=1e-7)
    # Both are the constraint of a third, where the wrist no longer decides anything.
    third = write("third", "rail", earlier('"second"'))
    run(third, tmp_path / "third")
    for joint in ("shoulder", "wrist"):
        same = angles(tmp_path / "third", joint), angles(tmp_path / "second", joint)
        np.testing.assert_allclose(*same, atol=1e-7)
    model = json.loads((tmp_path / "third" / "model.json").read_text())
    assert model["controlled"] == ["rail"]
    assert sorted(model["decided"]) == ["rail", "shoulder", "wrist"]


def test_the_folder_of_a_pass_needs_no_other(first: Path, write: Write, tmp_path: Path) -> None:
    run(write("second", "wrist", earlier('"first"')), tmp_path / "whole")
    first.rename(tmp_path / "elsewhere")
    copied = tmp_path / "whole" / "scene.toml"
    run(copied, tmp_path / "again")
    assert numbers(tmp_path / "again")[:2] == numbers(tmp_path / "whole")[:2]
    run(copied, tmp_path / "half", frames=2)
    run(tmp_path / "half" / "scene.toml", tmp_path / "half", frames=6, resume=True)
    assert numbers(tmp_path / "half")[:2] == numbers(tmp_path / "whole")[:2]


def test_a_pass_may_take_the_place_of_the_run_before_it(
    first: Path, write: Write, tmp_path: Path
) -> None:
    decided = angles(first, "shoulder")
    run(write("second", "wrist", earlier('"first"')), first, replace=True)
    np.testing.assert_allclose(angles(first, "shoulder"), decided, atol=1e-7)


def turning(times: Array) -> dict[str, Array]:
    """Poses of joints of every kind that have closed forms. Turns are about z."""
    turn = 0.4 * np.sin(3.0 * times)
    zero = np.zeros_like(times)
    quaternion = np.stack([np.cos(turn / 2.0), zero, zero, np.sin(turn / 2.0)], axis=1)
    # The other sign of a quaternion is the same turn.
    flipped = quaternion * np.where(np.arange(len(times)) % 2, -1.0, 1.0)[:, None]
    place = np.stack([times**2, 3.0 + times, zero], axis=1)
    return {
        "shoulder": turn[:, None],
        "rail": 0.1 * times[:, None] ** 3,
        "gaze": flipped,
        "drift": np.concatenate([place, flipped], axis=1),
    }


def test_joints_of_every_kind_do_the_same_again(write: Write, tmp_path: Path) -> None:
    """Through the frames exactly, between them and in their velocities as a cubic spline does."""
    times = np.arange(25) / 24.0
    np.savez(tmp_path / "known.npz", **{TIME: times + 7.0}, **turning(times))
    scene = load_scene(write("taken", "wrist", earlier('"known.npz"')))
    world = build(scene).world
    model = world.setup.solid
    (motion,) = trajectories_of(scene, model, world.solid.q)
    joints = sorted(turning(times), key=model.joint)
    between = 0.5 * (times[6:18] + times[7:19])
    known = turning(between)
    for row, time in enumerate(between):
        position, velocity = motion.position(time), motion.velocity(time)
        rate = 1.2 * np.cos(3.0 * time)
        spin, at = np.array([0.0, 0.0, rate]), 0
        rates = {
            "shoulder": [rate],
            "rail": [0.3 * time**2],
            "gaze": spin,
            "drift": [2.0 * time, 1.0, 0.0, *spin],
        }
        for joint in joints:
            place = position[at : at + known[joint].shape[1]]
            at += len(place)
            if joint in ("gaze", "drift"):
                left = product(inverse(known[joint][row, -4:]), place[-4:])
                assert np.abs(left[1:]).max() < 1e-6, joint
                place = place[:-4]
            np.testing.assert_allclose(place, known[joint][row, : len(place)], atol=1e-6)
        expected = np.concatenate([np.asarray(rates[joint], float) for joint in joints])
        np.testing.assert_allclose(velocity, expected, atol=2e-4)


def test_a_pass_that_is_longer_is_told(first: Path, write: Write) -> None:
    scene = load_scene(write("second", "wrist", earlier('"first"')), {"time.frames": "12"})
    world = build(scene).world
    notes = list(notes_of(scene, world.setup.solid))
    assert notes[0].startswith("[earlier]: that run is 0.25 s long and this one 0.5 s; its joints")
    (motion,) = trajectories_of(scene, world.setup.solid, world.solid.q)
    assert not motion.velocity(0.4).any()
    assert motion.position(0.4) == pytest.approx(motion.position(0.5))


def wrong_files(folder: Path) -> Iterator[tuple[str, dict[str, Any]]]:
    """Names of files, and the arrays in them."""
    times = np.arange(3.0)
    yield "none.npz", {TIME: times}
    yield "nan.npz", {TIME: times, "shoulder": np.full((3, 1), np.nan)}
    yield "still.npz", {TIME: np.zeros(3), "shoulder": np.zeros((3, 1))}
    yield "one.npz", {TIME: times[:1], "shoulder": np.zeros((1, 1))}
    yield "uneven.npz", {TIME: times, "shoulder": np.zeros((2, 1))}
    yield "wide.npz", {TIME: times, "shoulder": np.zeros((3, 2))}


@pytest.mark.parametrize(
    ("table", "joint", "message"),
    [
        ('"nowhere"', "wrist", "[earlier]: there is no folder {}/nowhere; give the folder of an"),
        ('"arm.xml"', "wrist", "[earlier]: {}/arm.xml is cut or no archive of arrays"),
        ('"none.npz"', "wrist", "{}/none.npz has no joint that was controlled. Give the folder of"),
        ('"nan.npz"', "wrist", "{}/nan.npz does not hold what joints did in a run"),
        ('"uneven.npz"', "wrist", "{}/uneven.npz does not hold what joints did in a run"),
        ('"still.npz"', "wrist", "{}/still.npz has no frame yet, or frames that do not follow"),
        ('"one.npz"', "wrist", "{}/one.npz has no frame yet"),
        ('"wide.npz"', "wrist", "joint 'shoulder' has 2 numbers in the earlier run and 1"),
        ('"first"', "shoulder", "what was controlled there is so here, or has a [[motion]]"),
        ('"first"\njoints = ["shoulder"]', "shoulder", "joint 'shoulder' is controlled as well."),
        ('"first"\njoints = ["rail"]', "wrist", "'rail' was not controlled in the earlier run"),
        ('"first"\njoints = ["elbow"]', "wrist", "joint 'elbow' is not in model arm.xml"),
        ('"first"\n[initial]\npositions = { shoulder = 3.0 }', "wrist", "motion of the [earlier]"),
    ],
)
def test_an_earlier_run_that_cannot_be_used_is_refused_in_one_message(
    first: Path, write: Write, tmp_path: Path, table: str, joint: str, message: str
) -> None:
    for name, arrays in wrong_files(tmp_path):
        np.savez(tmp_path / name, **arrays)
    with pytest.raises(SceneError) as refused:
        load_scene(write("second", joint, earlier(table)))
    (problem,) = refused.value.problems
    assert message.format(tmp_path) in problem


def test_an_earlier_run_without_a_frame_is_refused(
    first: Path, write: Write, tmp_path: Path
) -> None:
    for state in sorted((first / "states").iterdir())[1:]:
        state.unlink()
    with pytest.raises(SceneError, match="first has no frame yet"):
        load_scene(write("second", "wrist", earlier('"first"')))


def test_a_scene_without_the_table_has_no_earlier_run(write: Write) -> None:
    assert earlier_of(load_scene(write("first", "shoulder"))) is None


def test_a_path_on_the_command_line_starts_from_where_one_is(
    first: Path, write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    deeper = tmp_path / "deeper"
    deeper.mkdir()
    (deeper / "arm.xml").write_text(MODEL)
    scene = write("second", "wrist").rename(deeper / "second.toml")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        cli.main(["check", str(scene), "--set", "earlier.run=first"])
    assert ended.value.code == 0
