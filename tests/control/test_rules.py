"""Steps down a known slope."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flowborne.control.gradients import GradientCentral, OffsetPoses
from flowborne.control.rules import (
    FixedStep,
    GoldenSection,
    QuasiNewton,
    ResilientStep,
    Rule,
    descent,
)


@dataclass
class Line:
    """Poses of a function of n numbers around zero."""

    function: Callable[[np.ndarray], float]
    count: int = 1
    evaluations: int = 0

    def within_range(self, displacement: np.ndarray) -> np.ndarray:
        return displacement

    def values(self, displacements: np.ndarray) -> np.ndarray:
        self.evaluations += len(displacements)
        return np.array([self.function(d) for d in displacements])

    def gradient(self, displacement: np.ndarray) -> np.ndarray:
        return GradientCentral(1e-4).estimate(OffsetPoses(self, displacement)).gradient


@given(
    st.lists(st.floats(-1e6, 1e6).filter(lambda g: abs(g) > 1e-9), min_size=1, max_size=5),
    st.data(),
)
def test_longest_descent_that_strength_allows(gradient: list[float], data: st.DataObject) -> None:
    g = np.array(gradient)
    limit = np.array(data.draw(st.lists(st.floats(1e-3, 10), min_size=g.size, max_size=g.size)))
    move = descent(g, limit)
    assert np.max(np.abs(move) / limit) == pytest.approx(1.0)
    assert np.all(np.abs(move) <= limit)
    assert move @ g / (np.linalg.norm(move) * np.linalg.norm(g)) == pytest.approx(-1.0)


@pytest.mark.parametrize("gradient", [1e-300, 1e-8, 3.0, 1e12])
def test_step_of_one_dof_is_its_strength_however_small_the_gradient(gradient: float) -> None:
    for sign in (-1.0, 1.0):
        step = FixedStep().step(Line(lambda d: 0.0), np.array([sign * gradient]), np.array([0.03]))
        assert step == [-sign * 0.03]


@pytest.mark.parametrize("rule", [FixedStep(), GoldenSection(), QuasiNewton()])
def test_no_gradient_no_step(rule: Rule) -> None:
    line = Line(lambda d: 0.0, 2)
    assert not rule.step(line, np.zeros(2), np.ones(2)).any()
    assert line.evaluations == 0


@pytest.mark.parametrize("least", [0.0, 0.013, 0.1234, 0.31, 0.4999, 0.5, 0.9])
def test_golden_section_brackets_the_least(least: float) -> None:
    line = Line(lambda d: abs(d[0] + least) ** 1.5)
    step = GoldenSection(tolerance=0.01).step(line, np.array([1.0]), np.array([0.5]))
    assert abs(step[0] + min(least, 0.5)) <= 0.01 * 0.5
    assert line.evaluations <= 4 + np.ceil(np.log(0.01) / np.log(0.618)) + 1


def test_golden_section_reaches_farther_than_strength_but_steps_within_it() -> None:
    line = Line(lambda d: float((d[0] - 0.8) ** 2), 2)
    gradient, limit = np.array([-1.6, 0.4]), np.array([0.1, 0.1])
    near = GoldenSection(reach=2.0, tolerance=1e-3).step(line, gradient, limit)
    assert near == pytest.approx([0.1, -0.025])
    far = GoldenSection(reach=2.0, tolerance=1e-3).step(line, gradient, 100.0 * limit)
    assert far == pytest.approx([0.8, -0.2], abs=2e-3)


def test_golden_section_never_goes_uphill() -> None:
    line = Line(lambda d: float(np.cos(40.0 * d[0]) + 3.0 * abs(d[0])))
    step = GoldenSection().step(line, np.array([1.0]), np.array([0.5]))
    assert line.function(step) <= line.function(np.zeros(1))


def test_bad_searches_are_refused() -> None:
    with pytest.raises(ValueError, match=r"reach .* is 0"):
        GoldenSection(reach=0.0)
    with pytest.raises(ValueError, match=r"tolerance .* is 1"):
        GoldenSection(tolerance=1.0)


def test_resilient_scale_halves_where_the_gradient_turns_and_grows_back_to_one() -> None:
    rule, scale = ResilientStep(), np.ones(3)
    before = np.array([2.0, -1.0, 0.0])
    scale = rule.step_scale(scale, before, np.array([-1.0, -3.0, 5.0]))
    assert scale.tolist() == [0.5, 1.0, 1.0]
    for _ in range(20):
        scale = rule.step_scale(scale, before, -before)
    assert scale.tolist() == [rule.least, rule.least, 1.0]
    for _ in range(30):
        scale = rule.step_scale(scale, before, before)
    assert scale.tolist() == [1.0, 1.0, 1.0]
    assert FixedStep().step_scale(scale, before, -before).tolist() == [1.0, 1.0, 1.0]


@given(kink=st.floats(-0.4, 0.4), steep=st.floats(1.5, 20.0))
def test_resilient_steps_and_probes_find_a_lopsided_kink(kink: float, steep: float) -> None:
    """A central difference of 0.1 balances such a kink up to 0.09 away from it."""
    rule, at, scale, before, probe = ResilientStep(), 1.0, np.ones(1), np.zeros(1), 0.1

    def value(x: float) -> float:
        return abs(x - kink) * (steep if x > kink else 1.0)

    for _ in range(120):
        d = probe * float(scale[0])
        gradient = np.array([(value(at + d) - value(at - d)) / (2.0 * d)])
        scale, before = rule.step_scale(scale, before, gradient), gradient
        at += float((scale * descent(gradient, np.array([0.05])))[0])
    assert abs(at - kink) < 0.01


@pytest.mark.parametrize("bad", [{"shorten": 1.0}, {"lengthen": 1.0}, {"least": 0.0}])
def test_scales_that_cannot_settle_are_refused(bad: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="give"):
        ResilientStep(**bad)


def valley(x: np.ndarray) -> float:
    """A quadratic a thousand times as steep across its valley, x = y, as along it."""
    return float(500.0 * (x[0] - x[1]) ** 2 + 0.5 * (x[0] + x[1]) ** 2)


def rosenbrock(x: np.ndarray) -> float:
    return float(100.0 * (x[1] - x[0] ** 2) ** 2 + (1.0 - x[0]) ** 2)


def after(
    rule: Rule, function: Callable[[np.ndarray], float], at: tuple[float, float], decisions: int
) -> np.ndarray:
    """Where decisions with a strength of a tenth lead."""
    place = np.array(at)
    for _ in range(decisions):
        here = place.copy()
        line = Line(lambda d, here=here: function(here + d), 2)  # type: ignore[misc]
        place = place + rule.step(line, line.gradient(np.zeros(2)), np.full(2, 0.1))
    return place


def test_quasi_newton_goes_along_a_valley_in_which_the_steepest_way_stalls() -> None:
    """From (1, 0.6) to the origin in ten decisions that could go as far as 1."""
    assert np.abs(after(QuasiNewton(), valley, (1.0, 0.6), 10)).max() < 1e-6
    for rule in (FixedStep(), GoldenSection()):
        assert np.abs(after(rule, valley, (1.0, 0.6), 40)).max() > 0.7
    assert after(QuasiNewton(), rosenbrock, (-1.0, 1.0), 40) == pytest.approx([1, 1], abs=1e-3)
    for rule in (FixedStep(), GoldenSection()):
        assert after(rule, rosenbrock, (-1.0, 1.0), 40)[0] < -0.7


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_quasi_newton_stays_within_strength_whatever_the_unit(scale: float) -> None:
    """The least within a box of unequal sides: at its corner."""
    line = Line(lambda d: scale * float((d[0] - 3.0) ** 2 + (d[1] + 5.0) ** 2), 2)
    limit = np.array([0.5, 0.02])
    step = QuasiNewton().step(line, line.gradient(np.zeros(2)), limit)
    assert step == pytest.approx([0.5, -0.02])


def test_quasi_newton_heeds_the_range_of_joints() -> None:
    @dataclass
    class Ranged(Line):
        def within_range(self, displacement: np.ndarray) -> np.ndarray:
            return np.clip(displacement, -1.0, 0.01)

    tried: list[np.ndarray] = []

    def bowl(d: np.ndarray) -> float:
        tried.append(d.copy())
        return float((d[0] - 1.0) ** 2 + (d[1] + 0.05) ** 2 + d[0] * d[1])

    line = Ranged(bowl, 2)
    step = QuasiNewton().step(line, line.gradient(np.zeros(2)), np.full(2, 0.1))
    assert step == pytest.approx([0.01, -0.055], abs=1e-4)
    assert np.max(tried) <= 0.01


@pytest.mark.parametrize("gradients", [1, 2, 3])
def test_quasi_newton_costs_no_more_than_it_may(gradients: int) -> None:
    """A gradient is four trials here; that of the present pose has been paid for."""
    line = Line(lambda d: rosenbrock(d - 1.0), 2)
    slope = line.gradient(np.zeros(2))
    line.evaluations = 0
    step = QuasiNewton(gradients).step(line, slope, np.full(2, 0.5))
    assert line.evaluations == 4 * (gradients - 1) + gradients + 1
    assert line.function(step) < line.function(np.zeros(2))


def test_quasi_newton_goes_nowhere_when_nothing_is_better() -> None:
    """A slope that was estimated wrongly, as beside a kink."""
    line = Line(lambda d: float(np.abs(d).sum()), 2)
    assert not QuasiNewton().step(line, np.array([1.0, 1.0]), np.full(2, 0.1)).any()


def test_quasi_newton_needs_a_gradient() -> None:
    with pytest.raises(ValueError, match="give at least 1"):
        QuasiNewton(0)
