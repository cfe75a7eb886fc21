"""Finite differences against derivatives that are known."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from flowborne.control.gradients import GradientCentral, GradientOneSided


@dataclass
class Curve:
    """Poses of a function of n numbers, with a range around them."""

    function: Callable[[np.ndarray], float]
    here: np.ndarray
    low: float = -np.inf
    high: float = np.inf
    evaluations: int = 0

    @property
    def count(self) -> int:
        return self.here.size

    def within_range(self, displacement: np.ndarray) -> np.ndarray:
        return np.clip(displacement, self.low - self.here, self.high - self.here)

    def values(self, displacements: np.ndarray) -> np.ndarray:
        self.evaluations += len(displacements)
        return np.array([self.function(self.here + d) for d in displacements])


def wave(x: np.ndarray) -> float:
    return float(np.sin(x[0]) * np.exp(0.5 * x[1]) + x[2] ** 3)


HERE = np.array([0.4, -0.3, 0.7])
SLOPE = np.array([np.cos(0.4) * np.exp(-0.15), 0.5 * np.sin(0.4) * np.exp(-0.15), 3.0 * 0.7**2])


@pytest.mark.parametrize(
    ("kind", "order", "bound"), [(GradientCentral, 2.0, 3e-4), (GradientOneSided, 1.0, 0.03)]
)
def test_K7_error_order_of_differences(kind: type, order: float, bound: float) -> None:
    sizes = 0.1 * 0.5 ** np.arange(4)
    errors = np.array(
        [np.abs(kind(float(d)).estimate(Curve(wave, HERE)).gradient - SLOPE) for d in sizes]
    )
    fitted = np.polyfit(np.log(sizes), np.log(errors), 1)[0]
    assert np.all(np.abs(fitted - order) < 0.1), f"slopes {fitted}, expected {order}"
    assert errors[-1].max() < bound


def test_K7_cost_is_linear_in_dofs() -> None:
    for n in (1, 2, 5):
        central, one_sided = (Curve(lambda x: float(x @ x), np.ones(n)) for _ in range(2))
        GradientCentral(0.1).estimate(central)
        estimate = GradientOneSided(0.1).estimate(one_sided)
        assert (central.evaluations, one_sided.evaluations) == (2 * n, n + 1)
        assert estimate.value == n


def test_each_dof_has_its_own_displacement() -> None:
    tried = []
    curve = Curve(lambda x: tried.append(x.copy()) or float(x.sum()), np.zeros(2))
    GradientCentral((0.1, 0.3)).estimate(curve)
    assert np.array_equal(tried, [[0.1, 0.0], [0.0, 0.3], [-0.1, 0.0], [0.0, -0.3]])
    with pytest.raises(ValueError, match="2 displacements for 3"):
        GradientCentral((0.1, 0.3)).estimate(Curve(wave, HERE))


@pytest.mark.parametrize("kind", [GradientCentral, GradientOneSided])
@pytest.mark.parametrize("at", [0.0, 1.0])
def test_range_shortens_the_difference_and_not_the_slope(kind: type, at: float) -> None:
    curve = Curve(lambda x: float(3.0 * x[0] + 1.0), np.array([at]), low=0.0, high=1.0)
    assert kind(0.2).estimate(curve).gradient == pytest.approx([3.0], abs=1e-12)
    stuck = Curve(lambda x: float(3.0 * x[0]), np.array([0.0]), low=0.0, high=0.0)
    assert kind(0.2).estimate(stuck).gradient == [0.0]


@pytest.mark.parametrize("kind", [GradientCentral, GradientOneSided])
def test_rounding_is_no_gradient_and_a_small_slope_is_one(kind: type) -> None:
    rounding = Curve(lambda x: 1e3 * (1.0 + 2e-16 * np.sign(x[0])), np.zeros(1))
    assert kind(0.1).estimate(rounding).gradient == [0.0]
    small = Curve(lambda x: 1e-12 * float(x[0] + 0.01), np.zeros(1))
    assert kind(0.1).estimate(small).gradient == pytest.approx([1e-12], rel=1e-9)


@pytest.mark.parametrize("bad", [0.0, -0.1, np.nan, (0.1, np.inf)])
def test_bad_displacements_are_refused(bad: float) -> None:
    with pytest.raises(ValueError, match="displacement of the difference"):
        GradientCentral(bad)
