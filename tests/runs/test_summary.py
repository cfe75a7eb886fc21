import math

import pytest

from flowborne.runs.history import History
from flowborne.runs.summary import converged_frame, final_frames, final_means, summarise

ANGLE = "angle_hinge_rad"


def history_of(path, angles, objective=math.nan):
    columns = ("frame", "time_s", ANGLE, "objective", "seconds_total", "seconds_solids")
    history = History.create(path, columns)
    for frame, angle in enumerate(angles, start=1):
        seconds = 9.0 if frame == 1 else 0.5
        row = (frame, frame / 24, angle, objective, seconds, seconds / 2)
        history.append(dict(zip(columns, row, strict=True)))
    history.close()
    return path


@pytest.mark.parametrize(("frames", "last"), [(0, 0), (4, 4), (60, 10), (300, 30)])
def test_the_final_mean_is_over_a_tenth_but_at_least_ten_frames(frames, last):
    assert final_frames(frames) == last


@pytest.mark.parametrize(
    ("angles", "frame"),
    [
        ([0.5, 0.4, 0.3, 0.2, 0.1, *[0.0, 0.1] * 10], 4),
        ([*[0.0] * 10, 0.5, *[0.0] * 20], 12),
        ([0.0] * 20, 1),
        ([*[0.0] * 19, 5.0], None),
        ([*[0.5] * 5, *[0.0] * 19], None),
    ],
)
def test_convergence_is_the_first_frame_after_which_a_joint_stays_near_its_mean(
    tmp_path, angles, frame
):
    path = history_of(tmp_path / "history.csv", angles)
    means = final_means(path, [ANGLE], len(angles))
    assert converged_frame(path, means, {ANGLE: 0.15}, 20) == frame


def test_joints_that_have_just_come_to_rest_are_not_said_to_have_converged(tmp_path):
    """Neither in a run of a few frames, nor after fewer than ten decisions, nor where they follow
    what moves."""
    short = history_of(tmp_path / "short.csv", [0.0] * 19)
    long = history_of(tmp_path / "long.csv", [0.0] * 99)
    assert summarise(short, {ANGLE: 0.15}, 1)["converged_frame"] is None
    found = [summarise(long, {ANGLE: 0.15}, every)["converged_frame"] for every in (1, 10, None)]
    assert found == [1, None, None]


def test_a_summary_tells_where_the_time_went_without_the_first_frame(tmp_path):
    path = history_of(tmp_path / "history.csv", [0.25] * 5, objective=2.5)
    summary = summarise(path, {ANGLE: 0.1}, 1)
    assert summary["frames"] == 5
    assert summary["seconds_first_frame"] == 9.0
    assert summary["seconds_per_frame"] == 0.5
    assert summary["seconds_by_part"] == {"solids": 5.5}
    assert summary["final"] == summary["final_mean"] == {ANGLE: 0.25}
    assert summary["final_objective"] == 2.5
    assert summary["time_s"] == 5 / 24


def test_a_run_without_frames_or_controlled_joints_has_a_summary(tmp_path):
    empty = summarise(history_of(tmp_path / "empty.csv", []), {ANGLE: 0.1}, 1)
    assert (empty["frames"], empty["converged_frame"], empty["final"]) == (0, None, {})
    free = summarise(history_of(tmp_path / "free.csv", [0.1, 0.2]), {}, 1)
    assert (free["converged_frame"], free["final"]) == (None, {ANGLE: 0.2})
    assert free["final_objective"] is None
