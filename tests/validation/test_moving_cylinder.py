"""V3 on a coarse grid; V5: how the cylinder on its spring sets out; V8 on coarse grids."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.worlds import advance
from flowborne_validation.case import reference
from flowborne_validation.cases import case
from flowborne_validation.moving_cylinder import (
    CURVE,
    INNER,
    MASS,
    OUTER,
    PERIOD,
    SPIN,
    annulus,
    last_cycle,
    morison,
    sprung,
)


def test_V3_repeats_its_own_second_cycle_on_four_cells():
    """The source asks for 3 % of the largest force and for 0.15 all the way; the latter is 0.4
    off."""
    phases, forces = last_cycle(4, 2)
    moments, published = np.array(reference("V3", CURVE)).T
    away = np.interp(moments, phases, forces, period=1.0) - published
    assert np.sqrt(np.mean(away**2)) == pytest.approx(0.2124, rel=0.01)
    assert np.abs(forces).max() == pytest.approx(3.2653, rel=2e-3)


def test_V3_the_coefficients_of_a_force_that_has_them():
    phases = (np.arange(100) + 0.5) / 100
    angle = 2.0 * np.pi * phases
    v, rate = -np.cos(angle), 2.0 * np.pi / PERIOD * np.sin(angle)
    forces = -2.0 * np.abs(v) * v - 0.5 * np.pi * 1.5 * rate
    assert morison(phases, forces) == pytest.approx((2.0, 1.5))


def test_V5_the_spring_moves_the_cylinder_and_its_added_mass():
    """Of six cells across it, which give 1.5 % too much acceleration."""
    world = sprung(6, 5.0)
    world.solid.q[0] = 0.2
    advance(world, 1e-3)
    stiffness = MASS * (2.0 * np.pi / 5.0) ** 2
    free = -stiffness * 0.2 / (MASS + 0.25 * np.pi)
    assert world.solid.v[0] / 1e-3 == pytest.approx(1.0154 * free, rel=2e-3)


def test_V8_torque_is_of_second_order_and_within_a_third_of_a_percent():
    """Of 24 cells across b; the spin-down that it makes within 1 %. The source asks for 1 and 2."""
    torque, rate = case("V8").run(quick=True)
    assert torque.series.order == pytest.approx(2.0, abs=0.2), torque.lines
    assert torque.value == pytest.approx(1.0, abs=0.003), torque.lines
    assert rate.value == pytest.approx(1.0, abs=0.01), rate.lines


def test_V8_velocity_between_the_cylinders():
    """u = A r + B / r; on so few cells the error falls as the spacing to the power 1.5."""
    b = SPIN * INNER**2 * OUTER**2 / (OUTER**2 - INNER**2)
    a = -b / OUTER**2
    errors = []
    for cells in (12, 24):
        world = annulus(cells, free=False)
        advance(world, 0.1, 5)
        fluid, state = world.flow()
        x, y = np.meshgrid(*fluid.grid.face_coordinates(1)[:2], indexing="ij")
        r = np.hypot(x, y)
        between = (r > INNER) & (r < OUTER)
        exact = (a * r + b / r) * x / r
        wrong = np.abs(state.velocity[1][:, :, 0] - exact)[between]
        errors.append(float(np.sqrt(np.mean(wrong**2))) / (SPIN * INNER))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(1.5, abs=0.2), errors
    assert errors[1] < 0.0025, errors
