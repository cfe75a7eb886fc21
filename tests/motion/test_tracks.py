"""Prescribed motions: what they pass through, and that velocity is the derivative of position."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from flowborne.motion.formula import Formula
from flowborne.motion.tracks import (
    Curve,
    TrajectoryConstant,
    TrajectoryFormula,
    TrajectoryKeyframes,
    TrajectorySinusoid,
)
from flowborne.solids.trajectories import Trajectory

DOF = np.array([3])
STEP = 1e-6

moderate = st.floats(-5.0, 5.0)

GAIT = Formula("a * ramp(t) * sin(2*pi*(0.5*t - 0.14))", {"a": 0.7})


@st.composite
def curves(draw: st.DrawFn) -> Curve:
    gaps = draw(st.lists(st.floats(0.2, 3.0), min_size=1, max_size=6))
    start = draw(moderate)
    times = np.cumsum([start, *gaps])
    values = draw(st.lists(moderate, min_size=len(times), max_size=len(times)))
    return Curve(tuple(times), tuple(values))


motions = st.one_of(
    st.builds(TrajectoryConstant, st.just(DOF), moderate, moderate),
    st.builds(TrajectorySinusoid, st.just(DOF), moderate, st.floats(0.3, 5.0), moderate, moderate),
    st.builds(TrajectoryKeyframes, st.just(DOF), curves()),
    st.builds(TrajectoryFormula, st.just(DOF), st.just(GAIT), moderate),
)


@given(motions, st.floats(-8.0, 12.0))
def test_velocity_is_the_derivative_of_position(motion: Trajectory, time: float) -> None:
    slope = (motion.position(time + STEP) - motion.position(time - STEP)) / (2.0 * STEP)
    assert_allclose(motion.velocity(time), slope, rtol=1e-6, atol=2e-3)


@given(motions, st.floats(-8.0, 12.0))
def test_velocity_is_continuous(motion: Trajectory, time: float) -> None:
    assert_allclose(motion.velocity(time), motion.velocity(time + 1e-9), atol=1e-5)


@given(curves())
def test_curve_passes_exactly_through_its_keyframes(curve: Curve) -> None:
    assert [curve.value(time) for time in curve.times] == pytest.approx(curve.values, abs=1e-13)


def test_curve_may_be_all_but_flat() -> None:
    assert Curve((0.0, 1.0, 2.0), (0.0, 1e-310, 3e-310)).value(1.0) == 1e-310


@given(curves(), st.floats(0.0, 1.0))
def test_curve_stays_between_its_keyframes(curve: Curve, part: float) -> None:
    for t0, t1, v0, v1 in zip(
        curve.times, curve.times[1:], curve.values, curve.values[1:], strict=False
    ):
        value = curve.value(t0 + part * (t1 - t0))
        assert min(v0, v1) - 1e-12 <= value <= max(v0, v1) + 1e-12


def test_curve_rests_before_and_after_its_keyframes() -> None:
    curve = Curve((1.0, 2.0, 4.0), (5.0, -1.0, 3.0))
    assert (curve.value(-10.0), curve.value(10.0)) == (5.0, 3.0)
    assert [curve.slope(t) for t in (0.0, 1.0, 4.0, 9.0)] == [0.0] * 4


def test_curve_between_two_keyframes_is_the_cubic_hermite() -> None:
    curve = Curve((0.0, 2.0), (0.0, 1.0))
    s = 0.3
    assert curve.value(2.0 * s) == pytest.approx(3.0 * s**2 - 2.0 * s**3, abs=1e-14)


def test_sinusoid_at_known_times() -> None:
    motion = TrajectorySinusoid(DOF, amplitude=2.0, period=4.0, mean=1.0)
    assert_allclose([motion.position(t)[0] for t in (0.0, 1.0, 2.0, 3.0)], [1.0, 3.0, 1.0, -1.0])


@pytest.mark.parametrize(
    "motion",
    [
        TrajectoryConstant(DOF, 1.0, 2.0),
        TrajectorySinusoid(DOF, 1.0, 2.0),
        TrajectoryKeyframes(DOF, Curve((0.0, 1.0), (0.0, 1.0))),
        TrajectoryFormula(DOF, GAIT),
    ],
)
def test_motions_survive_pickling(motion: Trajectory) -> None:
    again = pickle.loads(pickle.dumps(motion))
    assert again.position(0.4) == motion.position(0.4)
    assert again.velocity(0.4) == motion.velocity(0.4)
