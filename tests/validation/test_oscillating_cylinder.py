"""V3 on a coarse grid; V5: how the cylinder on its spring sets out."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.validation.case import reference
from flowborne.validation.oscillating_cylinder import (
    CURVE,
    MASS,
    PERIOD,
    last_cycle,
    morison,
    sprung,
)
from flowborne.worlds import advance


def test_V3_repeats_its_own_second_cycle_on_four_cells():
    """The source asks for 3 % of the largest force and for 0.15 all the way; these are 5 % and 0.4
    off."""
    phases, forces = last_cycle(4, 2)
    moments, published = np.array(reference("V3", CURVE)).T
    away = np.interp(moments, phases, forces, period=1.0) - published
    assert np.sqrt(np.mean(away**2)) == pytest.approx(0.2011, rel=0.01)
    assert np.abs(forces).max() == pytest.approx(3.1262, rel=2e-3)


def test_V3_the_coefficients_of_a_force_that_has_them():
    phases = (np.arange(100) + 0.5) / 100
    angle = 2.0 * np.pi * phases
    v, rate = -np.cos(angle), 2.0 * np.pi / PERIOD * np.sin(angle)
    forces = -2.0 * np.abs(v) * v - 0.5 * np.pi * 1.5 * rate
    assert morison(phases, forces) == pytest.approx((2.0, 1.5))


def test_V5_the_spring_moves_the_cylinder_and_its_added_mass():
    """Of six cells across it, which give 1.2 % too much acceleration."""
    world = sprung(6, 5.0)
    world.solid.q[0] = 0.2
    advance(world, 1e-3)
    stiffness = MASS * (2.0 * np.pi / 5.0) ** 2
    free = -stiffness * 0.2 / (MASS + 0.25 * np.pi)
    assert world.solid.v[0] / 1e-3 == pytest.approx(1.0122 * free, rel=2e-3)
