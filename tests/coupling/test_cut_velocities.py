"""Velocity on cut faces: the mean over their open part."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne import Array, Grid
from flowborne.worlds import (
    Boundaries,
    BoundaryInflow,
    advance,
    cut_by_bodies,
    make_world,
    set_velocity,
)
from flowborne_validation.worlds import mjcf

RADIUS, HALF = 0.5, 1.5
"""m, of the circle and of the square domain around it."""


def stream(x: Array, y: Array) -> Array:
    """Stream function of a unit stream along x past the circle, m^2/s; 0 within it."""
    square = x**2 + y**2
    return np.where(square > RADIUS**2, y * (1.0 - RADIUS**2 / np.maximum(square, RADIUS**2)), 0.0)


def along_sides(x: Array, y: Array, z: Array, time: float = 0.0) -> tuple[Array, Array, Array]:
    """Velocity of that flow, m/s."""
    square, part = x**2 + y**2, RADIUS**2
    u = 1.0 - part * (x**2 - y**2) / square**2
    return u, -2.0 * part * x * y / square**2, 0.0 * z


def errors(cells: int, place: tuple[float, float]) -> tuple[Array, Array]:
    """Error on each cut face after an impulsive start, m/s, and how much of it is open.

    cells  to a diameter
    place  of the circle in its cell, cells
    """
    h = 2.0 * RADIUS / cells
    n = round(2.0 * HALF / h)
    grid = Grid.slab(n, n, h, tuple(-HALF - h * np.array(place)))
    side = BoundaryInflow(along_sides)
    sides = Boundaries(x_min=side, x_max=side, y_min=side, y_max=side)
    world = make_world(mjcf(f'<geom type="sphere" size="{RADIUS}"/>'), grid, boundaries=sides)
    set_velocity(world, lambda x, y, z: (1.0 + 0.0 * x, 0.0 * y, 0.0 * z))
    advance(world, 1e-6)
    wrong, opened = [], []
    for axis in (0, 1):
        x, y, _ = grid.face_coordinates(axis)
        x, y = np.meshgrid(x, y, indexing="ij")
        step = 0.5 * h * np.eye(2)[1 - axis]
        ends = stream(x + step[0], y + step[1]), stream(x - step[0], y - step[1])
        part = cut_by_bodies(world).open[axis][:, :, 0]
        cut = (part > 0.0) & (part < 1.0)
        flux = (ends[0] - ends[1]) * (1 - 2 * axis)
        wrong.append((world.flow()[1].velocity[axis][:, :, 0] - flux / (h * part.clip(1e-12)))[cut])
        opened.append(part[cut])
    return np.concatenate(wrong), np.concatenate(opened)


@pytest.mark.parametrize(("cells", "bound"), [(8, 0.06), (16, 0.03), (32, 0.02)])
def test_the_velocity_on_cut_faces_is_that_of_potential_flow(cells: int, bound: float) -> None:
    """Root of the mean square over five places of the circle in its cell, over the stream."""
    places = [(0.0, 0.0), (0.5, 0.5), (0.13, 0.37), (0.29, 0.08), (0.41, 0.22)]
    wrong = np.concatenate([errors(cells, place)[0] for place in places])
    assert np.sqrt(np.mean(wrong**2)) < bound


@pytest.mark.parametrize("place", [(0.0, 0.0), (0.13, 0.37)])
def test_a_disc_that_turns_leaves_the_fluid_at_rest(place: tuple[float, float]) -> None:
    """It displaces nothing, and a fluid without viscosity does not slow it down."""
    grid = Grid.slab(24, 24, 0.1, (-1.2, -1.2))
    world = make_world(mjcf('<body><freejoint/><geom type="sphere" size="0.5"/></body>'), grid)
    world.solid.q[:2] = np.multiply(place, grid.spacing)
    world.solid.v[-1] = 2.0
    for _ in range(10):
        assert advance(world, 0.05).fastest < 1e-12
    assert world.solid.v[-1] == pytest.approx(2.0, rel=1e-12)
