"""Figures of a signal that is known."""

import numpy as np
import pytest

from flowborne_validation.shedding import Oscillation, amplitude, crest

PERIOD, DT = 0.317, 0.004


@pytest.fixture
def seen():
    angle = 2.0 * np.pi * DT * np.arange(700) / PERIOD
    return Oscillation(DT, 0.05 + np.sin(angle)), 3.1 + 0.02 * np.cos(2.0 * angle)


def test_period_and_amplitude(seen):
    lift, drag = seen
    steps, period = lift.last(4)
    assert period == pytest.approx(PERIOD, rel=1e-3)
    assert amplitude(lift.signal[steps]) == pytest.approx(1.0, rel=1e-4)
    assert drag[steps].mean() == pytest.approx(3.1, rel=1e-4)
    assert crest(lift.signal[steps])[0] == pytest.approx(1.05, rel=1e-4)


def test_too_few_periods_are_said(seen):
    with pytest.raises(ArithmeticError, match="21 are needed"):
        seen[0].last(20)


def test_crest_of_a_parabola_is_exact():
    x = np.arange(9.0)
    assert crest(2.0 - (x - 4.3) ** 2) == pytest.approx((2.0, 4.3))
