"""When objectives count."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from flowborne.control.phases import PhaseAlways, PhaseIntervals, PhaseTrack


class Swing:
    """position sin t, velocity cos t, of the second of two dofs."""

    dofs = np.array([0, 1])

    def position(self, time: float) -> np.ndarray:
        return np.array([5.0, math.sin(time)])

    def velocity(self, time: float) -> np.ndarray:
        return np.array([5.0, math.cos(time)])


def test_always_is_on() -> None:
    assert PhaseAlways().active(-1e9)


def test_intervals_are_half_open_and_forgive_rounding() -> None:
    phase = PhaseIntervals(((0.5, 1.0), (2.0, 3.0)))
    on = [phase.active(t) for t in (0.0, 0.5, 0.999, 1.0, 1.5, 2.5, 3.0)]
    assert on == [False, True, True, False, False, True, False]
    accumulated = sum([0.1] * 10)  # just below 1
    assert accumulated < 1.0
    assert not phase.active(accumulated)


@given(
    turn=st.integers(-50, 50),
    time=st.floats(0.0, 1.7499, allow_nan=False),
    edge=st.sampled_from([0.25, 1.0, 1.5]),
)
def test_phases_that_share_a_period_follow_one_another(turn: int, time: float, edge: float) -> None:
    first, second = PhaseIntervals(((0.0, edge),), 1.75), PhaseIntervals(((edge, 1.75),), 1.75)
    assume(min(abs(time - edge), time, 1.75 - time) > 1e-6)
    now = time + turn * 1.75
    assert first.active(now) == (time < edge)
    assert second.active(now) == (time >= edge)


def test_interval_wraps_around_the_end_of_its_period() -> None:
    phase = PhaseIntervals(((0.75, 1.25),), 1.0)
    assert [phase.active(t) for t in (0.1, 0.3, 0.8, 5.2, 5.3)] == [True, False, True, True, False]


def test_opposite_track_phases_share_all_time() -> None:
    up, down = PhaseTrack(Swing(), column=1), PhaseTrack(Swing(), column=1, sign=-1)
    high = PhaseTrack(Swing(), "position", threshold=0.5, column=1)
    for time in np.linspace(0.0, 20.0, 101):
        assert up.active(time) != down.active(time)
        assert up.active(time) == (math.cos(time) >= 0.0)
        assert high.active(time) == (math.sin(time) >= 0.5)


@pytest.mark.parametrize(
    ("intervals", "period"),
    [(((1.0, 1.0),), None), (((0.0, 2.0),), 1.0), (((math.nan, 1.0),), None), ((), 0.0)],
)
def test_bad_intervals_are_refused(intervals: tuple, period: float | None) -> None:
    with pytest.raises(ValueError, match="phase"):
        PhaseIntervals(intervals, period)


def test_bad_track_phase_is_refused() -> None:
    with pytest.raises(ValueError, match="sign is 0"):
        PhaseTrack(Swing(), sign=0)
    with pytest.raises(ValueError, match="'angle'"):
        PhaseTrack(Swing(), "angle")  # type: ignore[arg-type]
