"""V8: flow between coaxial cylinders, on coarse grids."""

import numpy as np

from flowborne.validation import case
from flowborne.validation.viscous import INNER, OUTER, SPIN, annulus
from flowborne.worlds import advance


def test_V8_torque_comes_near():
    torque, rate = case("V8").run(quick=True)
    assert torque.series.falls, torque.lines
    assert torque.series.order > 1.0, torque.lines
    assert torque.series.errors[-1] < 0.08, torque.lines
    assert rate.series.errors[-1] < 0.06, rate.lines


def test_V8_velocity_between_the_cylinders():
    """u = A r + B / r; the error falls faster than the spacing."""
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
    assert errors[1] < 0.5 * errors[0], errors
    assert errors[1] < 0.015, errors
