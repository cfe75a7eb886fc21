"""Cases A1 and A2, short."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.validation import pendulums
from flowborne.validation.case import table


@pytest.mark.parametrize("degrees", [10.0, 90.0, 170.0])
def test_A1_period_at_amplitude(degrees: float) -> None:
    ratio = table("A1", "T/T0")[degrees]
    t0 = pendulums.small_period(1.2, 0.3)
    model = pendulums.bar(1.2, 0.3)
    errors = [
        abs(pendulums.period(model, np.radians(degrees), t0 / n, 1.3 * ratio * t0) / t0 - ratio)
        for n in (40, 80)
    ]
    assert errors[1] < 1e-3 * ratio
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.2)


@pytest.mark.parametrize(("number", "expected"), [(0, 0.765367), (1, 1.847759)])
def test_A2_modes(number: int, expected: float) -> None:
    assert pendulums.mode(number, 100) == pytest.approx(expected, rel=1e-3)


def test_A2_energy_and_joints() -> None:
    drift, apart = pendulums.swings(100, 10.0)
    assert abs(drift) < 1e-4
    assert apart < 1e-12


def test_A2_gravity_turns_the_angular_momentum() -> None:
    assert pendulums.turning(0.005, 0.5) < 1e-5
