"""B1 and B2: flow past a cylinder, on a coarse grid."""

import numpy as np
import pytest

from flowborne.validation import case
from flowborne.validation.fixed_bodies import (
    CENTRE,
    DIAMETER,
    Parabola,
    channel,
    pressure_drop,
    recirculation,
)
from flowborne.worlds import set_velocity, start_from


def test_B1_repeats_its_own_figures_on_ten_cells_across_D():
    """Too few for the intervals of the source, which 80 cells meet: the figures are coarse."""
    found = case("B1").run(quick=True)
    own = 5.60601, 0.0033405, 0.112597, 0.0841804
    assert [result.value for result in found] == pytest.approx(own, rel=2e-3)
    assert {result.verdict for result in found} == {"coarse"}


def test_B1_figures_of_a_known_flow():
    """A linear pressure and a velocity that changes its sign at a known place."""
    world = channel(10, Parabola(0.3))
    fluid, state = world.flow()
    x, _, _ = fluid.grid.cell_coordinates()
    state.pressure[:] = (1.0 - 3.0 * x)[:, None, None]
    x, _, _ = fluid.grid.face_coordinates(0)
    state.velocity[0][:] = (x - 0.333)[:, None, None]
    assert pressure_drop(world) == pytest.approx(3.0 * DIAMETER, rel=1e-12)
    assert recirculation(world) == pytest.approx(0.333 - CENTRE - 0.5 * DIAMETER, rel=1e-12)


def test_refined_flow_is_the_coarse_one():
    coarse, fine = channel(10, Parabola(0.3)), channel(20, Parabola(0.3))
    set_velocity(coarse, Parabola(0.3))
    coarse.flow()[1].pressure[:] = np.arange(220.0)[:, None, None]
    start_from(coarse, fine)
    fluid, state = fine.flow()
    x, y, z = np.meshgrid(*fluid.grid.face_coordinates(0), indexing="ij")
    exact = Parabola(0.3)(x, y, z)[0]
    assert np.abs(state.velocity[0] - exact).max() < 0.01 * 0.3
    assert not state.velocity[1].any()
    np.testing.assert_allclose(np.diff(state.pressure[:, 0, 0]), 0.5)
