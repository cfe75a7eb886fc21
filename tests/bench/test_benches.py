"""Every bench on a small scene: what it measures, not how fast that is."""

import os

import numpy as np
import pytest

from flowborne import Simulation, load_scene
from flowborne.machine import PARTS, cores
from flowborne_validation.bench import frame_costs, speed, startup, steps
from flowborne_validation.bench.timing import frame_times

from ..made_runs import spring_scene

COARSE = {"domain.resolution": "16", "controller.settle_steps": "0"}


@pytest.fixture
def scene(small_scene):
    """A scene without a fluid."""
    return load_scene(small_scene)


def judged(result, met):
    """Whether a result says what its figure is worth."""
    return result.target and result.verdict == ("pass" if met else "fail")


def test_simulations_take_turns_and_the_first_frame_is_not_timed(scene):
    with Simulation(scene, 1) as one, Simulation(scene, 1) as other:
        times = frame_times([one, other], 3)
        assert (one.frame, other.frame) == (4, 4)
    assert times.shape == (2, 3)
    assert np.all(times > 0.0)


@pytest.mark.usefixtures("shared_processes")
def test_workers_are_compared_in_threads_and_in_processes(scene):
    result = speed.compare_workers(scene, frames=2)
    assert [line.split()[:2] for line in result.lines[1:]] == [["two", e] for e in speed.EXECUTORS]
    assert result.title.endswith(speed.EXECUTORS)
    assert judged(result, result.value >= speed.FASTER)


@pytest.mark.parametrize(
    ("times", "off", "line"),
    [
        ([1.0, 3.0, 5.0, 7.0], 0.0, "line -1000.0 ms + 2000.0 ms a joint"),
        ([1.0, 2.0, 4.0, 8.0], 0.7 / 0.3, "line -2000.0 ms + 2300.0 ms a joint"),
    ],
    ids=["a line", "a doubling"],
)
def test_chain_is_judged_by_how_far_its_quickest_frames_are_from_a_line(
    scene, monkeypatch, times, off, line
):
    rows = np.array(times)[:, None] + [[0.0, 9.0]]
    monkeypatch.setattr(speed, "times_together", lambda runs, frames: rows)
    result = speed.straightness([scene] * 4)
    assert result.value == pytest.approx(off, abs=1e-12)
    assert judged(result, off <= speed.DEVIATION)
    assert result.lines[-1] == line


def test_speed_is_frames_a_second_over_those_shown():
    result = speed.default_speed(load_scene(speed.BLOCK, COARSE), seconds=0.1)
    assert result.value > 0.0
    assert "16 x 16 cells" in result.title
    assert judged(result, result.value >= 1.0)


def test_parts_of_a_frame_add_up():
    result = frame_costs.shares(load_scene(frame_costs.BLOCK, COARSE), frames=2)
    assert [line.split()[0] for line in result.lines] == [*PARTS, "rest"]
    spent = [float(line.split()[1]) for line in result.lines]
    assert min(spent) >= 0.0
    assert sum(spent) == pytest.approx(result.value, abs=0.005 * len(spent))


def test_steps_count_what_they_call_and_take():
    coarse = {"domain.resolution": "16"}
    for result in (
        steps.of_room(load_scene("flyer-base", coarse), 1.0, frames=1),
        steps.of_trials(load_scene(steps.BLOCK, coarse), 1.0, frames=1),
    ):
        assert result.value > 1.0
        assert judged(result, met=False)
        calls, memory = result.lines[-3:-1] if "flyer" in result.title else result.lines[-2:]
        assert 100.0 < float(calls.split()[0]) < 20_000.0
        assert float(memory.split()[0]) > 0.0
    assert "of 18 steps" in result.lines[0]  # two trials of a move and eight steps to settle


def test_memory_of_a_run_does_not_grow():
    scene = load_scene(frame_costs.BLOCK, COARSE)
    per_cell, growth = frame_costs.footprint(scene, early=30, late=60)
    assert 100.0 < per_cell.value < 100_000.0
    assert growth.verdict == "pass", growth
    assert growth.value > 0.0


def test_first_run_keeps_its_kernels_apart(tmp_path):
    assert startup.run_once(str(spring_scene(tmp_path)), tmp_path) > 0.0
    assert os.listdir(tmp_path / "run")
    assert list((tmp_path / "kernels").rglob("*.nbi"))


def test_first_run_and_a_later_one_are_judged(monkeypatch):
    seconds, folders = iter([50.0, 6.0]), []
    monkeypatch.setattr(
        startup, "run_once", lambda _, folder: folders.append(folder) or next(seconds)
    )
    first, later = startup.first_run()
    assert judged(first, met=True)
    assert judged(later, met=False)
    assert folders[0] == folders[1]


def test_start_is_that_of_the_command():
    (result,) = startup.start(repeats=1)
    assert result.value > 0.0
    assert judged(result, result.value < startup.HELP)


def test_growth_names_time_and_memory_of_every_size():
    scenes = [load_scene("flyer-base", {"domain.resolution": str(n)}) for n in (10, 12)]
    result = frame_costs.growth(scenes, frames=1)
    assert result.verdict == "info"
    assert np.isfinite(result.value)
    assert "10 x 10 x 9 cells" in result.lines[0]
    assert "bytes a cell" in result.lines[1]
    assert "projection" in result.lines[1]
    assert "threads" in result.lines[-2] or cores() == 1
    assert "GB/s" in result.lines[-1]


@pytest.mark.usefixtures("shared_processes")
def test_a_human_is_timed_in_every_way():
    result = speed.best_speed(load_scene("human-gravity-back"), frames=1)
    assert judged(result, result.value >= 1.0)
    assert [line.split()[1] for line in result.lines] == ["serial", "threads", "processes"]


def test_threads_change_no_bit():
    """On 16 cells no kernel starts a thread: what is tested is the comparison."""
    result = speed.compare_threads(load_scene("flyer-base", {"domain.resolution": "16"}), frames=1)
    assert judged(result, True)
    assert result.value == 0
