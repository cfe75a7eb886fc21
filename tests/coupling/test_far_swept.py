"""Bodies that cross many cells in a step: it is done in parts, and energy comes from drives."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne import Array, Grid, Outcome, StepReport, World, step
from flowborne.bodies import JointCommand
from flowborne.worlds import (
    Boundaries,
    BoundaryInflow,
    BoundaryOpen,
    BoundaryPeriodic,
    advance,
    kinetic_energy,
    make_world,
    set_velocity,
)
from flowborne_validation.worlds import RING, mjcf

LONG = 0.2
"""m, half the length of the plate across its way, or all of it from its hinge."""

PLATES = {
    "slides": '<body pos="{x} 0.5 {z}"><joint type="slide" axis="1 0 0"/>'
    '<geom type="box" size="0.06 0.2 0.12"/></body>',
    "turns": '<body pos="{x} 0.5 {z}"><joint type="hinge" axis="0 0 1"/>'
    '<geom type="box" size="0.06 0.2 0.12" pos="0 -0.2 0"/></body>',
}
ARM = {"slides": 1.0, "turns": 2.0 * LONG}
"""m from the hinge to the tip; of what slides its own way."""

AROUND = Boundaries(*(BoundaryPeriodic(),) * 6)


def blow(x: Array, y: Array, z: Array, time: float = 0.0) -> tuple[Array, Array, Array]:
    return 1.0 + 0.0 * x, 0.0 * x, 0.0 * x


CHANNEL = Boundaries(x_min=BoundaryInflow(blow), x_max=BoundaryOpen())


def slab(cells: int) -> Grid:
    return Grid.slab(cells, cells, 1.0 / cells, (0.0, 0.0))


def room(cells: int) -> Grid:
    return Grid((cells,) * 3, 1.0 / cells, (0.0, 0.0, 0.0))


def plate(way: str, grid: Grid, sides: Boundaries) -> World:
    body = PLATES[way].format(x=0.4, z=0.0 if grid.is_slab else 0.5)
    return make_world(mjcf(body), grid, boundaries=sides)


def swept(world: World, dt: float, rate: float, held: bool) -> StepReport:
    """After a step in which the joint goes at a rate, and is held still at the end or goes on."""
    command = JointCommand.none(1)
    command.set(np.array([0]), rate, 0.0 if held else rate)
    report = step(world, dt, command)
    assert report.outcome is Outcome.DONE
    assert report.momentum_budget_error < 1e-10
    return report


@pytest.mark.parametrize("way", PLATES)
@pytest.mark.parametrize(
    ("grid", "cells"),
    [(slab(96), 8), (slab(128), 12), (slab(160), 20), (room(48), 6)],
    ids=["8 of 96", "12 of 128", "20 of 160", "6 of 48 in a room"],
)
def test_a_plate_gives_fluid_at_rest_no_more_energy_than_its_drive_has(
    way: str, grid: Grid, cells: int
) -> None:
    """Over many cells in a step, which is done in parts; in the first the flow starts with it."""
    world, dt = plate(way, grid, Boundaries()), 0.02
    tip = cells * grid.spacing / dt
    rate = tip / ARM[way]
    world.solid.v[0] = rate
    for _ in range(3):
        before = kinetic_energy(world)
        work = swept(world, dt, rate, held=False).work
        assert 0.0 < kinetic_energy(world) - before < work
    assert world.parts in (cells, cells + 1)


@pytest.mark.parametrize("way", PLATES)
@pytest.mark.parametrize("dt", [0.005, 0.02, 0.08])
@pytest.mark.parametrize(("count", "cells"), [(96, 8), (160, 20)])
def test_a_plate_gives_a_stream_no_more_energy_than_its_drive_has(
    way: str, count: int, cells: int, dt: float
) -> None:
    """As in a hypothetical step: displaced, and held. The stream brings what it carries in."""
    grid = slab(count)
    world = plate(way, grid, CHANNEL)
    set_velocity(world, blow)
    advance(world, 1e-9)
    for values in (*world.flow()[1].acceleration, world.flow()[1].pressure):
        values[:] = 0.0
    tip, brought = cells * grid.spacing / dt, 0.5 * grid.spacing * dt
    for _ in range(2):
        before = kinetic_energy(world)
        report = swept(world, dt, tip / ARM[way], held=True)
        pushed = float(
            report.momentum_boundary[0]
        )  # by the side that a unit stream comes in through
        assert kinetic_energy(world) - before < report.work + brought + pushed


def test_a_step_over_many_cells_is_so_many_short_ones() -> None:
    """To the bit, and so is its report: sums of what was exchanged, means of forces."""
    whole, short = (plate("slides", slab(96), Boundaries()) for _ in range(2))
    rate, dt = 8.0 / 96 / 0.02, 0.02
    for world in (whole, short):
        world.solid.v[0] = rate
    report = swept(whole, dt, rate, held=True)
    parts = [swept(short, dt / 8, rate, held=True) for _ in range(8)]
    assert whole.parts == 8
    for one, other in zip(whole.flow()[1].velocity, short.flow()[1].velocity, strict=True):
        np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(whole.solid.v, short.solid.v)
    assert report.dt == pytest.approx(dt)
    assert report.work == pytest.approx(sum(part.work for part in parts))
    exchanged = np.sum([part.momentum_exchanged for part in parts], axis=0)
    np.testing.assert_allclose(report.momentum_exchanged, exchanged, rtol=1e-12)
    force = np.mean([part.pressure_wrench for part in parts], axis=0)
    np.testing.assert_allclose(report.pressure_wrench, force, rtol=1e-12, atol=1e-12)
    swept(whole, dt, 0.0, held=True)
    assert whole.parts == 8, "a number once raised is kept"


def stays_uniform(grid: Grid, dt: float, steps: int, bound: float) -> None:
    """A stream past a plate that goes with it by nine cells in 0.02 s, around the ring."""
    speed = 9.0 * grid.spacing / 0.02
    world = plate("slides", grid, RING if grid.is_slab else AROUND)
    world.solid.v[0] = speed
    set_velocity(world, lambda x, y, z: (speed + 0.0 * x, 0.0 * x, 0.0 * x))
    for _ in range(steps):
        swept(world, dt, speed, held=False)
        for axis, u in enumerate(world.flow()[1].velocity):
            assert np.abs(u - (speed if axis == 0 else 0.0)).max() < bound * speed


@pytest.mark.parametrize("grid", [slab(96), room(40)], ids=["slab", "room"])
def test_a_stream_stays_uniform_past_a_plate_that_goes_with_it(grid: Grid) -> None:
    """By nine cells in a step, around the ring and again."""
    stays_uniform(grid, 0.02, 4, 1e-10)


@pytest.mark.parametrize("grid", [slab(24), room(20)], ids=["slab", "room"])
def test_a_stream_stays_uniform_past_a_plate_wherever_the_plate_is(grid: Grid) -> None:
    """It crosses the periodic side in steps of 0.75 cells."""
    stays_uniform(grid, 0.02 / 12.0, 26, 1e-12)


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_a_velocity_that_is_no_number_is_told_before_the_solve(wrong: float) -> None:
    world = plate("slides", slab(16), Boundaries())
    world.flow()[1].velocity[0][4, 4] = wrong
    report = step(world, 0.01)
    assert report.outcome is Outcome.ADVECTION_NOT_FINITE
    assert report.solver_iterations == 0
    with pytest.raises(ArithmeticError, match="not a finite number after advection"):
        advance(world, 0.01)
