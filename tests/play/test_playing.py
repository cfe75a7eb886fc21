"""A simulation that is played: settings act, it goes back to earlier frames, and is recorded."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import flowborne as fb
from flowborne.play.groups import with_choices
from flowborne.play.memory import PlayedRun
from flowborne.play.playing import Moment, Play
from flowborne.runs.run_folder import RunFolderError

SPEED, DIRECTION, GUSTS = "wind: speed (m/s)", "wind: direction (°)", "wind: gusts (%)"
GOAL = "objective of hinge: objective"


def bits(moment: Moment) -> dict[str, bytes]:
    return {name: values.tobytes() for name, values in moment.snapshot.world.arrays().items()}


@pytest.fixture
def play(small_scene: Path) -> Iterator[Play]:
    played = Play(fb.load_scene(small_scene), workers=1)
    yield played
    played.close()


def advanced(play: Play, moment: Moment, frames: int, **settings: float | str) -> Moment:
    """The moment some frames later, with other settings than at the start."""
    for _ in range(frames):
        moment = play.advance(moment, play.controls.settings() | settings)
    return moment


def test_untouched_it_has_the_bits_of_a_run(play: Play, small_scene: Path) -> None:
    moment = advanced(play, play.first, 5)
    assert moment.changes == ()
    with fb.Simulation(small_scene, workers=1) as simulation:
        for _ in range(5):
            simulation.advance_frame()
        arrays = simulation.world.arrays()
    assert bits(moment) == {name: values.tobytes() for name, values in arrays.items()}


def test_a_wind_that_turns_pushes_the_other_way_in_the_next_frame(play: Play) -> None:
    before = advanced(play, play.first, 2)
    after = advanced(play, before, 1, **{DIRECTION: 180.0})
    assert before.state["fluid_force"][1, 0] > 0.0
    assert after.state["fluid_force"][1, 0] < 0.0
    (change,) = after.changes
    assert change.values == {"wind.0.velocity": [-5.0, 0.0, 0.0]}


def test_an_objective_that_is_chosen_replaces_that_of_the_scene(play: Play) -> None:
    (group,) = play.controls.groups
    least = advanced(play, play.first, 8)
    most = advanced(play, play.first, 8, **{GOAL: "most drag"})
    drags = [abs(moment.state["fluid_force"][1, 0]) for moment in (least, most)]
    assert drags[1] > 1.5 * drags[0]
    assert most.values[f"objectives.{group.own[0]}.weight"] == 0.0
    off = advanced(play, play.first, 8, **{"objective of hinge: weight": 0.0})
    still = play.first.state["q"]
    np.testing.assert_array_equal(off.state["q"], still)


def test_back_at_an_earlier_frame_it_goes_on_to_the_same_bits_or_others(play: Play) -> None:
    """Settings made since are forgotten there."""
    early = advanced(play, play.first, 3)
    first = advanced(play, early, 3)
    other = advanced(play, early, 3, **{SPEED: 9.0})
    again = advanced(play, early, 3)
    assert bits(again) == bits(first) != bits(other)
    assert again.changes == ()


def test_gusts_go_up_and_down_about_the_wind(play: Play) -> None:
    moment, forces = play.first, []
    for _ in range(48):
        moment = advanced(play, moment, 1, **{GUSTS: 50.0})
        values = play.simulation.report.values
        forces.append(values["wind.0.velocity"][0])
    assert max(forces) == pytest.approx(7.5)
    assert forces[:24] == sorted(forces[:24])
    assert forces[24:] == sorted(forces[24:], reverse=True)
    assert forces[-1] == pytest.approx(2.5)


def test_a_recording_repeats_what_was_played(play: Play, tmp_path: Path) -> None:
    moment = advanced(play, play.first, 2)
    moment = advanced(play, moment, 2, **{DIRECTION: 77.0, GUSTS: 30.0})
    moment = advanced(play, moment, 3, **{GOAL: "least effort", SPEED: 7.0})
    assert "bit for bit" in play.record(moment, tmp_path / "played")
    again = fb.run(tmp_path / "played" / "scene.toml", tmp_path / "again", film=False)
    assert again.frames == 7
    last = fb.open_run(again.folder).state(-1)
    for name, values in moment.state.items():
        np.testing.assert_array_equal(values, last[name])
    after = advanced(play, moment, 1, **{GOAL: "least effort", SPEED: 7.0})
    assert after.frame == 8


def test_nothing_played_is_not_recorded(play: Play, tmp_path: Path) -> None:
    with pytest.raises(RunFolderError, match="nothing has been played yet"):
        play.record(play.first, tmp_path / "played")


def test_frames_in_memory_are_a_run(play: Play) -> None:
    run = PlayedRun(play)
    for _ in range(6):
        run.append(advanced(play, run.moments[-1], 1))
    run.update_history()
    assert list(run.frames) == list(range(7))
    assert run.times[-1] == pytest.approx(0.25)
    assert run.every("geom_position").shape[0] == len(run) == 7
    assert list(run.history["frame"]) == [1, 2, 3, 4, 5, 6]
    assert run.row(0) is None
    run.cut(3)
    assert (len(run), run.frames[-1], len(run.times)) == (3, 2, 3)


def test_the_oldest_frames_are_dropped_beyond_the_memory(play: Play) -> None:
    run = PlayedRun(play, most=4 * advanced(play, play.first, 1).bytes)
    for _ in range(8):
        run.append(advanced(play, run.moments[-1], 1))
    assert list(run.frames) == [5, 6, 7, 8]
    assert run.times[0] == pytest.approx(5 / 24)


@pytest.mark.parametrize("name", ["human-wind-all", "human-wind-drag", "ns-chain-4", "eel"])
def test_joints_are_grouped_by_their_objectives(name: str) -> None:
    scene = fb.load_scene(name)
    chosen, groups = with_choices(scene)
    count = {"human-wind-all": 14, "human-wind-drag": 3, "ns-chain-4": 1, "eel": 0}[name]
    assert len(groups) == count
    assert chosen.objectives[: len(scene.objectives)] == scene.objectives
    assert all(table.weight == 0.0 for table in chosen.objectives[len(scene.objectives) :])
    assert {joint for group in groups for joint in group.joints} == set(scene.controlled_joints())


def test_controls_of_a_scene_with_a_stream() -> None:
    played = Play(fb.load_scene("ns-block-drag-max", {"domain.resolution": "24"}), workers=1)
    names = [control.name for control in played.controls.all]
    assert "stream at x_min: speed (m/s)" in names
    assert "strength: hinge (°/s)" in names
    (picker,) = (control for control in played.controls.all if control.options)
    assert picker.options == ("as in the scene", "least effort", "least drag", "most drag")
    played.close()
