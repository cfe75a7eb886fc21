"""What acts before a step."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne import Array, Grid, World, step
from flowborne.coupling.cut import departure
from flowborne.coupling.half_pressure import explicit_half_pressure, pressure_increment_ratio
from flowborne.worlds import Boundaries, BoundaryOpen, make_world, set_velocity
from flowborne_validation.worlds import mjcf

DT = 1.0 / 64
SQUARE = Grid.slab(32, 32, 1.0 / 32, (0.0, 0.0))
BODY = mjcf('<body pos="0.4 0.45 0"><freejoint/><geom type="sphere" size="0.12"/></body>')

FRAME = mjcf(
    '<body pos="0.40625 0.4375 0"><freejoint/>'
    '<geom type="box" size="0.016 0.05 0.1" pos="0.1035 0 0"/>'
    '<geom type="box" size="0.016 0.05 0.1" pos="-0.1035 0 0"/>'
    '<geom type="box" size="0.1 0.016 0.1" pos="0 0.041 0"/>'
    '<geom type="box" size="0.1 0.016 0.1" pos="0 -0.041 0"/></body>'
)
"""Thin walls around a room of 5.6 x 1.6 cells of `SQUARE`, which is open in six by two."""


def swirl(x: Array, y: Array, z: Array) -> tuple[Array, Array, Array]:
    u, v = np.sin(np.pi * x) * np.cos(np.pi * y), -np.cos(np.pi * x) * np.sin(np.pi * y)
    return u, v, 0.0 * z


@pytest.mark.parametrize(
    ("earlier", "part"),
    [(1.0, 1.0), (0.7, 1.0), (1.5, 0.5), (0.1, 0.2), (20.0, 0.0), (-0.5, 0.0)],
    ids=["steady", "rises", "falls", "an impulse", "after an impulse", "turned round"],
)
def test_a_pressure_goes_on_unless_it_is_an_impulse(earlier: float, part: float) -> None:
    assert pressure_increment_ratio(earlier) == pytest.approx(part)


@pytest.mark.parametrize("sides", [Boundaries(), Boundaries(x_max=BoundaryOpen())])
def test_half_of_the_last_pressure_acts_where_no_side_is_open(sides: Boundaries) -> None:
    world = make_world(BODY, SQUARE, solid_density=0.5, boundaries=sides)
    set_velocity(world, swirl)
    turned(world, 4)
    last = world.flow()[1].pressure.copy()
    half = explicit_half_pressure(world, departure(world), DT)
    np.testing.assert_allclose(half.pressure + world.flow()[1].pressure, last, rtol=1e-14)
    if sides.x_max.kind == "open":
        assert not half.pressure.any()
        assert not half.impulse.any()
    else:
        assert 0.3 < half.pressure.max() / last.max() <= 0.5
        assert np.abs(half.impulse).max() > 0.0


def turned(world: World, steps: int) -> World:
    for _ in range(steps):
        assert step(world, DT).outcome.name == "DONE"
    return world


def test_a_pocket_that_has_lost_its_fluid_pushes_nothing() -> None:
    """Bodies that part leave one: what its last pressure gave to them, no fluid would give."""
    world = make_world(FRAME, SQUARE, solid_density=100.0)
    set_velocity(world, swirl)
    cut, state = departure(turned(world, 4)).cut, world.flow()[1]
    room = (slice(10, 16), slice(13, 15))
    assert np.all(cut.open[0][11:16, 13:15] > 0.0)
    assert np.ptp(state.pressure[room]) > 1e-4
    state.cell_volume[room] = 1e-13 * SQUARE.cell_volume
    world.volumes = None
    turned(world, 1)
    assert np.abs(state.cell_volume[room]).max() < 1e-9 * SQUARE.cell_volume
    assert not state.pressure[room].any()
    assert step(world, DT).momentum_budget_error < 1e-13


def test_the_pressure_of_a_step_is_that_of_the_whole_step() -> None:
    """With and without what acts beforehand the bodies are pushed alike, but for the error in time:
    the reported pressure is all of it, and so is the wrench."""
    world = make_world(BODY, SQUARE, solid_density=0.5)
    set_velocity(world, swirl)
    other = turned(world, 4).copy()
    flow = other.flow()[1]
    flow.pressure[:], flow.previous_pressure[:] = 0.0, 0.0
    with_it, without = step(world, DT), step(other, DT)
    force, alone = with_it.pressure_wrench[1], without.pressure_wrench[1]
    assert np.abs(force - alone).max() < 0.05 * np.abs(alone).max()
    level = world.flow()[1].pressure - other.flow()[1].pressure
    spread = np.ptp(level[world.flow()[1].cell_volume > 0.5 / 32**2])
    assert spread < 0.1 * np.ptp(other.flow()[1].pressure)
