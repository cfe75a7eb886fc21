"""B1 and B2: flow past a cylinder, on a coarse grid; B3, its first instants."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.worlds import set_velocity, start_from
from flowborne_validation.channel_cylinder import (
    CENTRE,
    DIAMETER,
    DURATION,
    HEIGHT,
    channel,
    pressure_drop,
    pulse,
    pulsed_inflow,
    steady_flow,
)
from flowborne_validation.shedding import backflow
from flowborne_validation.worlds import ORIGIN, PLACES, Parabola, Place


def test_B1_repeats_its_own_figures_on_ten_cells_across_D():
    """Too few for the intervals of the source, which 80 cells meet; in the first of five places."""
    inflow = Parabola(0.3)
    world = channel(10, PLACES[0], inflow)
    set_velocity(world, inflow)
    drag, lift, _ = steady_flow(world, 2e-5)
    own = 5.57112, 0.00931266, 0.111012, 0.0833178
    back = (CENTRE + 0.5 * DIAMETER, CENTRE, 0.0)
    found = drag, lift, pressure_drop(world), backflow(world, back, 0.3)
    assert found == pytest.approx(own, rel=2e-3)


@pytest.mark.parametrize("place", PLACES)
def test_the_cylinder_is_where_its_place_says(place: Place) -> None:
    """Along the channel; across it on a plane of nodes or in the middle between two."""
    grid = channel(10, place, Parabola(0.3)).flow()[0].grid
    x, y = (CENTRE - grid.origin[axis] for axis in (0, 1))
    assert x / grid.spacing % 1.0 == pytest.approx(place[0])
    assert y / grid.spacing % 1.0 == pytest.approx(
        20.0 * 42.0 / 41.0 % 1.0 if place[1] > 0.5 else 0.0, abs=1e-9
    )
    assert grid.upper[1] == pytest.approx(HEIGHT)


@pytest.mark.parametrize("place", [ORIGIN, *PLACES[:2]])
def test_B1_figures_of_a_known_flow(place):
    """A linear pressure and a velocity that changes its sign at a known place."""
    world = channel(10, place, Parabola(0.3))
    fluid, state = world.flow()
    x, _, _ = fluid.grid.cell_coordinates()
    state.pressure[:] = (1.0 - 3.0 * x)[:, None, None]
    x, _, _ = fluid.grid.face_coordinates(0)
    state.velocity[0][:] = (x - 0.333)[:, None, None]
    assert pressure_drop(world) == pytest.approx(3.0 * DIAMETER, rel=1e-12)
    back = CENTRE + 0.5 * DIAMETER
    assert backflow(world, (back, CENTRE, 0.0), 0.3) == pytest.approx(0.333 - back, rel=1e-12)


def test_refined_flow_is_the_coarse_one():
    coarse, fine = channel(10, ORIGIN, Parabola(0.3)), channel(20, ORIGIN, Parabola(0.3))
    set_velocity(coarse, Parabola(0.3))
    coarse.flow()[1].pressure[:] = np.arange(220.0)[:, None, None]
    start_from(coarse, fine)
    fluid, state = fine.flow()
    x, y, z = np.meshgrid(*fluid.grid.face_coordinates(0), indexing="ij")
    exact = Parabola(0.3)(x, y, z)[0]
    assert np.abs(state.velocity[0] - exact).max() < 0.01 * 0.3
    assert not state.velocity[1].any()
    np.testing.assert_allclose(np.diff(state.pressure[:, 0, 0]), 0.5)


def test_B3_the_inflow_swells_and_dies_away():
    y = np.array([0.0, 0.5 * HEIGHT, HEIGHT])
    for time, peak in ((0.0, 0.0), (0.5 * DURATION, 1.5), (DURATION, 0.0)):
        u, v, _ = pulsed_inflow(np.zeros(3), y, np.zeros(3), time)
        np.testing.assert_allclose(u, [0.0, peak, 0.0], atol=1e-12)
        assert not v.any()


def test_B3_begins_as_an_ideal_fluid_that_is_set_going():
    """The stream's own pressure gradient and the added mass: 2 rho pi D^2 / 4 dU/dt. The parabola
    comes in and evens out downstream: U lies between its mean and its peak."""
    _, drag, lift, _ = pulse(10, ORIGIN, duration=0.1)[1]
    force = 2.0 * 0.25 * np.pi * DIAMETER**2 * 1.5 * np.pi / DURATION
    assert 2.0 / 3.0 < drag / (2.0 * force / DIAMETER) < 1.0
    assert abs(lift) < 0.02 * drag
