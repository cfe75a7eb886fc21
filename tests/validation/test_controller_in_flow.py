"""Cases K5 and K6: how a course is judged, and the law of the frames in simple winds."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne_validation import cases
from flowborne_validation import controller_in_flow as case


def test_K6_law_of_the_frames() -> None:
    for result in cases.case("K6").run(quick=True):
        assert result.verdict == "pass", f"{result.quantity}: {result.value} {result.lines}"


def test_course_that_arrives_and_chatters() -> None:
    angles = np.concatenate([np.arange(30.0, 0.0, -2.0), np.tile([1.0, -1.0], 15)])
    found = case.judged(angles, 2.0)
    assert found.final == pytest.approx(0.0)
    assert found.frames == 14
    assert found.chatter == pytest.approx(0.5)


def test_course_that_does_not_arrive_counts_all_its_frames() -> None:
    found = case.judged(np.linspace(0.0, 100.0, 51), 2.0)
    assert found.frames == 50
    assert found.chatter > 1.0


def test_K5_held_block_feels_more_drag_across_the_stream() -> None:
    assert case.held_drag(0.0, 24, 2.0) > 2.0 * case.held_drag(90.0, 24, 2.0)


@pytest.mark.parametrize(
    ("angle", "incidence"), [(0.0, 90.0), (90.0, 0.0), (-90.0, 0.0), (180.0, 90.0), (60.0, 30.0)]
)
def test_angle_to_the_stream(angle: float, incidence: float) -> None:
    assert case.from_wind(angle) == pytest.approx(incidence)
