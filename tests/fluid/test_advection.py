"""Semi-Lagrangian advection: order, exactness, periodic sides, bounds."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.fluid.advection import CENTRE, OFFSETS, carry, cells_per_step
from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.ghosts import pad_cells, pad_faces
from flowborne.fluid.grid import Array, Faces, Grid
from flowborne.fluid.sides.periodic import BoundaryPeriodic

RING = BoundaryPeriodic()
TORUS = Boundaries(RING, RING, RING, RING, RING, RING)
WALLS = Boundaries()


def sides_of(grid: Grid, periodic: bool) -> Boundaries:
    if not periodic:
        return WALLS
    return Boundaries(RING, RING, RING, RING) if grid.is_slab else TORUS


def uniform(grid: Grid, velocity: tuple[float, ...]) -> Faces:
    u, v, w = (np.full(grid.face_shape(axis), velocity[axis]) for axis in range(3))
    return u, v, w


def steps(
    values: Array,
    velocity: Faces,
    dt: float,
    grid: Grid,
    sides: Boundaries,
    count: int,
) -> Array:
    """A cell field carried by a steady velocity (half-way, m/s) for so many steps."""
    advecting_velocity = cells_per_step(pad_faces(velocity, grid, sides, 0.0), dt, grid.spacing)
    counts, periodic = np.array(grid.shape), np.array(sides.periodic(), np.uint8)
    for _ in range(count):
        field, out = pad_cells(values, grid, sides), np.empty_like(values)
        carry(out, field, *advecting_velocity, CENTRE, counts, periodic)
        values = out
    return values


def order_of(errors: list[float], grids: tuple[int, ...]) -> float:
    return -float(np.polyfit(np.log(grids), np.log(errors), 1)[0])


def wave(x: Array, y: Array) -> Array:
    return np.sin(2 * np.pi * x) * np.cos(2 * np.pi * y) + 0.5 * np.cos(2 * np.pi * (x + y))


def test_order_of_a_translation_around_a_ring() -> None:
    """Half around x and a quarter around y, 3.2 and 1.6 cells a step."""
    grids, errors = (64, 128, 256), []
    for n in grids:
        grid = Grid.slab(n, n, 1.0 / n, (0.0, 0.0))
        count = 5 * n // 32
        x, y, _ = np.meshgrid(*grid.cell_coordinates(), indexing="ij")
        velocity, sides = uniform(grid, (2.0, 1.0, 0.0)), sides_of(grid, True)
        after = steps(wave(x, y), velocity, 0.25 / count, grid, sides, count)
        errors.append(float(np.abs(after - wave(x - 0.5, y - 0.25)).mean()))
    assert order_of(errors, grids) == pytest.approx(1.0, abs=0.2), errors
    assert errors[-1] < 0.1, errors


def test_order_of_a_rotation() -> None:
    """A smooth blob a quarter turn around the middle of a closed box."""
    grids: tuple[int, ...] = (32, 64, 128)
    errors = []
    for n in grids:
        grid = Grid.slab(n, n, 1.0 / n, (-0.5, -0.5))
        count = n
        dt = 0.5 * np.pi / count
        faces = grid.zeros_faces()
        for axis in (0, 1):
            x, y, _ = np.meshgrid(*grid.face_coordinates(axis), indexing="ij")
            # from where a particle leaves straight to where it arrives
            there = x * np.cos(dt) - y * np.sin(dt), x * np.sin(dt) + y * np.cos(dt)
            faces[axis][:] = (there[axis] - (x, y)[axis]) / dt
        x, y, _ = np.meshgrid(*grid.cell_coordinates(), indexing="ij")
        blob = np.exp(-((x - 0.2) ** 2 + y**2) / 0.015)
        turned = np.exp(-(x**2 + (y - 0.2) ** 2) / 0.015)
        after = steps(blob, faces, dt, grid, WALLS, count)
        errors.append(float(np.abs(after - turned).sum() / blob.sum()))
    assert order_of(errors, grids) == pytest.approx(1.0, abs=0.25), errors
    assert errors[-1] < 0.15, errors


@pytest.mark.parametrize("shape", [(12, 9, 1), (8, 7, 6)])
@pytest.mark.parametrize("periodic", [False, True])
def test_a_constant_field_stays_constant_to_the_last_bit(
    shape: tuple[int, int, int], periodic: bool
) -> None:
    grid, random = Grid(shape, 0.1), np.random.default_rng(5)
    x, y, z = (random.normal(size=grid.face_shape(axis)) for axis in range(3))
    sides = sides_of(grid, periodic)
    values = np.full(shape, 0.7)
    after = steps(values, (x, y, z), 0.15, grid, sides, 3)
    np.testing.assert_array_equal(after, values)


@pytest.mark.parametrize("shape", [(12, 10, 1), (8, 7, 6)])
def test_a_shift_by_whole_cells_around_a_ring_is_exact(shape: tuple[int, int, int]) -> None:
    """Two cells back in x, three on in y, one back in z, across the sides."""
    grid, random = Grid(shape, 0.5), np.random.default_rng(6)
    values = random.random(shape)
    shift = (-2, 3, 0 if grid.is_slab else -1)
    velocity = uniform(grid, tuple(0.5 * s / 0.25 for s in shift))
    after = steps(values, velocity, 0.25, grid, sides_of(grid, True), 1)
    np.testing.assert_allclose(after, np.roll(values, shift, (0, 1, 2)), atol=1e-13)


@pytest.mark.parametrize("courant", [0.3, 1.7])
def test_translation_around_a_ring_conserves_the_dye(courant: float) -> None:
    grid = Grid.slab(40, 24, 0.025, (0.0, 0.0))
    x, y, _ = np.meshgrid(*grid.cell_coordinates(), indexing="ij")
    values = np.exp(-((x - 0.5) ** 2 + (y - 0.3) ** 2) / 0.02)
    velocity = uniform(grid, (courant * 0.025, 0.4 * courant * 0.025, 0.0))
    after = steps(values, velocity, 1.0, grid, sides_of(grid, True), 40)
    # interpolation weights of a uniform shift add up to 1 for every cell
    assert after.sum() == pytest.approx(values.sum(), rel=1e-12)


@pytest.mark.parametrize("courant", [0.3, 0.5, 1.7])
def test_a_front_never_leaves_its_values(courant: float) -> None:
    """A broad band of dye around a ring."""
    grid = Grid.slab(64, 4, 1.0, (0.0, 0.0))
    values = np.zeros(grid.shape)
    values[10:40] = 1.0
    velocity = uniform(grid, (courant, 0.0, 0.0))
    values = steps(values, velocity, 1.0, grid, sides_of(grid, True), 300)
    assert values.min() >= -1e-14
    assert 0.9 < values.max() <= 1.0 + 1e-14


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_faces_are_carried_from_where_they_live(axis: int) -> None:
    """A velocity linear in space, shifted by half a cell on every axis, is exact inside."""
    grid = Grid((8, 9, 10), 0.25)
    velocity = grid.zeros_faces()
    x, y, z = np.meshgrid(*grid.face_coordinates(axis), indexing="ij")
    velocity[axis][:] = 1.0 + 2.0 * x - 3.0 * y + 0.5 * z
    move = (0.125, -0.125, 0.125)
    advecting_velocity = cells_per_step(pad_faces(uniform(grid, move), grid, TORUS, 0.0), 1.0, 0.25)
    field = pad_faces(velocity, grid, WALLS, 0.0)[axis]
    out, never = np.empty_like(velocity[axis]), np.zeros(3, np.uint8)
    carry(out, field, *advecting_velocity, OFFSETS[axis], np.array(grid.shape), never)
    expected = velocity[axis] - (2.0 * move[0] - 3.0 * move[1] + 0.5 * move[2])
    inside = (slice(1, -1),) * 3
    np.testing.assert_allclose(out[inside], expected[inside], atol=1e-13)


def test_kernel_agrees_with_plain_interpolation() -> None:
    """A semi-Lagrangian step against bilinear interpolation written out."""
    grid, random = Grid.slab(10, 8, 1.0, (0.0, 0.0)), np.random.default_rng(9)
    values, move = random.random((10, 8, 1)), (0.37, -1.21)
    after = steps(values, uniform(grid, (*move, 0.0)), 1.0, grid, sides_of(grid, True), 1)
    i, j = np.meshgrid(np.arange(10), np.arange(8), indexing="ij")
    x, y = i - move[0], j - move[1]
    a, b = x - np.floor(x), y - np.floor(y)
    m, n = np.floor(x).astype(int), np.floor(y).astype(int)
    expected = sum(
        wa * wb * values[(m + p) % 10, (n + q) % 8, 0]
        for p, wa in ((0, 1 - a), (1, a))
        for q, wb in ((0, 1 - b), (1, b))
    )
    np.testing.assert_allclose(after[:, :, 0], expected, atol=1e-14)
