"""What acts before a step, and what open sides hold back."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.coupling.flow import hold_back
from flowborne.coupling.step import step
from flowborne.coupling.world import Fluid, World
from flowborne.fluid.boundary import Boundaries, BoundaryOpen
from flowborne.fluid.grid import Faces, Grid
from flowborne.validation.worlds import mjcf, set_velocity, world_of

OPEN = BoundaryOpen()
GRID = Grid.slab(8, 6, 0.25, (0.0, 0.0))
FLUID = Fluid(GRID, 2.0, boundaries=Boundaries(OPEN, OPEN))


def flow_through_sides(low: list[float], high: list[float]) -> tuple[Faces, Faces, Faces]:
    """Velocity (m/s) across both x sides row by row, open parts, and masses (kg)."""
    velocity = GRID.zeros_faces()
    velocity[0][0, :, 0], velocity[0][-1, :, 0] = low, high
    opened = tuple(np.ones_like(u) for u in velocity)
    mass = tuple(FLUID.density * GRID.cell_volume * o for o in opened)
    return velocity, (opened[0], opened[1], opened[2]), (mass[0], mass[1], mass[2])


def test_open_sides_let_a_stream_pass_and_hold_back_what_comes_in_faster() -> None:
    """Out at the upper side; in at the lower one, faster in one row than in the others."""
    low, high = [1.0, 1.0, 1.0, 1.0, 1.0, 4.0], [1.0, 2.0, 3.0, 1.0, 0.5, 0.1]
    velocity, opened, mass = flow_through_sides(low, high)
    hold_back(velocity, opened, mass, FLUID, 1e-4)
    np.testing.assert_array_equal(velocity[0][-1, :, 0], high)
    np.testing.assert_array_equal(velocity[0][0, :5, 0], low[:5])
    # rho (u - U)^2 / 2 on one face of the area A: the mass there is that of one cell, rho A h
    given = 1e-4 * 0.5 * (4.0 - 1.5) ** 2 / 0.25
    assert low[-1] - velocity[0][0, 5, 0] == pytest.approx(given, rel=1e-3)


def test_what_open_sides_hold_back_is_never_turned_round() -> None:
    velocity, opened, mass = flow_through_sides([-1.0, 90.0, -1.0, -1.0, -1.0, -90.0], [0.0] * 6)
    hold_back(velocity, opened, mass, FLUID, 10.0)
    assert 0.0 < velocity[0][0, 1, 0] < 90.0
    np.testing.assert_array_equal(velocity[0][0, [0, 5], 0], [-1.0, -90.0])


def turned(world: World, steps: int) -> World:
    for _ in range(steps):
        assert step(world, 1.0 / 64).outcome.name == "DONE"
    return world


def test_the_pressure_of_a_step_is_that_of_the_whole_step() -> None:
    """With and without what acts beforehand the bodies are pushed alike, but for the error in time:
    the reported pressure is all of it, and so is the wrench."""
    body = mjcf('<body pos="0.4 0.45 0"><freejoint/><geom type="sphere" size="0.12"/></body>')
    world = world_of(Grid.slab(32, 32, 1.0 / 32, (0.0, 0.0)), body, solid_density=0.5)
    set_velocity(
        world,
        lambda x, y, z: (
            np.sin(np.pi * x) * np.cos(np.pi * y),
            -np.cos(np.pi * x) * np.sin(np.pi * y),
            0 * z,
        ),
    )
    other = turned(world, 4).copy()
    flow = other.flow()[1]
    flow.pressure[:], flow.earlier[:] = 0.0, 0.0
    with_it, without = step(world, 1.0 / 64), step(other, 1.0 / 64)
    force, alone = with_it.pressure_wrench[1], without.pressure_wrench[1]
    assert np.abs(force - alone).max() < 0.05 * np.abs(alone).max()
    level = world.flow()[1].pressure - other.flow()[1].pressure
    spread = np.ptp(level[world.flow()[1].cells > 0.5 / 32**2])
    assert spread < 0.1 * np.ptp(other.flow()[1].pressure)
