"""Dye: what enters, what stays, what never happens."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.fluid.advection import cells_per_step
from flowborne.fluid.boundary import (
    Boundaries,
    BoundaryInflow,
    BoundaryOpen,
    BoundaryPeriodic,
    Source,
)
from flowborne.fluid.ghosts import pad_faces
from flowborne.fluid.grid import Array, Faces, Grid
from flowborne.fluid.scalars import carry_scalars, cells_in
from flowborne.kernels.node_distance import BAND

RING = BoundaryPeriodic()


def carried(
    dye: Array,
    velocity: Faces,
    dt: float,
    grid: Grid,
    sides: Boundaries,
    count: int = 1,
    sources: tuple[Source, ...] = (),
) -> Array:
    """A dye carried by a steady velocity for so many steps, with nothing in the way."""
    clear = np.full(tuple(n + 1 for n in grid.shape), BAND * grid.spacing)
    carrier = cells_per_step(pad_faces(velocity, grid, sides, 0.0), dt, grid.spacing)
    for n in range(count):
        time = (n + 1) * dt
        scalars = {"dye": dye}
        dye = carry_scalars(scalars, carrier, clear, clear, grid, sides, sources, time)["dye"]
    return dye


def uniform(grid: Grid, *velocity: float) -> Faces:
    u, v, w = (np.full(grid.face_shape(axis), velocity[axis]) for axis in range(3))
    return u, v, w


def vortex(grid: Grid) -> Faces:
    """One vortex in a closed unit box."""
    faces = grid.zeros_faces()
    for axis in (0, 1):
        x, y, _ = np.meshgrid(*grid.face_coordinates(axis), indexing="ij")
        u = np.sin(np.pi * x) * np.cos(np.pi * y)
        faces[axis][:] = u if axis == 0 else -np.cos(np.pi * x) * np.sin(np.pi * y)
    return faces


@pytest.mark.parametrize("shape", [(12, 9, 1), (8, 7, 6)])
def test_dye_that_is_everywhere_stays_so_to_the_last_bit(shape: tuple[int, int, int]) -> None:
    grid, random = Grid(shape, 0.1), np.random.default_rng(5)
    x, y, z = (random.normal(size=grid.face_shape(axis)) for axis in range(3))
    dye = np.full(shape, 0.3)
    np.testing.assert_array_equal(carried(dye, (x, y, z), 0.2, grid, Boundaries(), 4), dye)


def test_dye_goes_around_a_ring_and_comes_back() -> None:
    grid = Grid.slab(64, 32, 1.0 / 32, (0.0, 0.0))
    sides = Boundaries(RING, RING, RING, RING)
    x, y, _ = np.meshgrid(*grid.cell_coordinates(), indexing="ij")
    dye = 2.0 + np.sin(np.pi * x) * np.cos(2 * np.pi * y)
    after = carried(dye, uniform(grid, 2.0, 1.0, 0.0), 1.0 / 80, grid, sides, 80)
    np.testing.assert_allclose(after, dye, atol=0.04)
    assert after.sum() == pytest.approx(dye.sum(), rel=1e-9)
    whole = carried(dye, uniform(grid, 2.0, 1.0, 0.0), 1.0 / 32, grid, sides, 32)
    np.testing.assert_allclose(whole, dye, atol=1e-12)


def test_nothing_is_lost_by_a_translation_inside_the_box() -> None:
    grid = Grid.slab(64, 32, 1.0 / 32, (0.0, 0.0))
    x, y, _ = np.meshgrid(*grid.cell_coordinates(), indexing="ij")
    dye = np.exp(-((x - 0.5) ** 2 + (y - 0.5) ** 2) / 0.01)
    after = carried(dye, uniform(grid, 1.0, 0.1, 0.0), 0.02, grid, Boundaries(), 40)
    assert after.sum() == pytest.approx(dye.sum(), rel=5e-3)
    assert (x * after).sum() / after.sum() == pytest.approx(0.5 + 0.8, abs=2e-3)
    assert (y * after).sum() / after.sum() == pytest.approx(0.5 + 0.08, abs=2e-3)


def test_bands_in_a_vortex_swing_over_their_values_by_a_bounded_part() -> None:
    """The limiter's room for a smooth extremum: folds of 0 and 1 use it, and no more each time.

    Holding the dye between 0 and 1 would cost the blob of case F4 a few per cent of its mass.
    """
    grid = Grid.slab(64, 64, 1.0 / 64, (0.0, 0.0))
    _, y, _ = np.meshgrid(*grid.cell_coordinates(), indexing="ij")
    dye = (np.floor(16 * y) % 2.0).astype(float)
    faces, total = vortex(grid), dye.sum()
    for _ in range(8):
        dye = carried(dye, faces, 0.5 / 64, grid, Boundaries(), 50)
        assert dye.min() > -0.45
        assert dye.max() < 1.45
    assert dye.sum() == pytest.approx(total, rel=0.02)


def test_dye_enters_with_an_inflow_and_leaves_through_an_open_side() -> None:
    """A band that is switched on: after a time t it fills the first u t of the channel, a cell
    less, which is what the interpolation at the side costs once."""

    def band(x: Array, y: Array, z: Array, time: float) -> Array:
        return np.where((y > 0.25) & (y < 0.75), 1.0, 0.0) + 0 * x

    def stream(x: Array, y: Array, z: Array, time: float) -> tuple[Array, Array, Array]:
        return 1.0 + 0 * x, 0 * x, 0 * x

    grid = Grid.slab(64, 32, 1.0 / 32, (0.0, 0.0))
    sides = Boundaries(x_min=BoundaryInflow(stream, {"dye": band}), x_max=BoundaryOpen())
    dye, there = np.zeros(grid.shape), []
    for _ in range(6):
        dye = carried(dye, uniform(grid, 1.0, 0.0, 0.0), 0.02, grid, sides, 25)
        there.append(dye.sum() * grid.cell_volume)
        assert not dye[:, :7].any()
    assert 0.5 * (0.5 - 1.0 / 32) < there[0] < 0.5 * 0.5
    np.testing.assert_allclose(np.diff(there[:3]), 0.5 * 0.5, rtol=0.01)
    np.testing.assert_allclose(there[-1], 0.5 * 2.0, rtol=1e-5)
    np.testing.assert_allclose(dye[:, 8:24], 1.0, atol=1e-3)


def test_a_source_keeps_its_dye_for_its_time() -> None:
    grid = Grid.slab(10, 10, 0.1, (0.0, 0.0))
    source = Source((0.2, 0.2, -1), (0.4, 0.5, 1), scalars={"dye": 0.8}, times=(0.0, 0.25))
    box = cells_in(source, grid)
    assert [(s.start, s.stop) for s in box[:2]] == [(2, 4), (2, 5)]
    still = uniform(grid, 0.0, 0.0, 0.0)
    dye = carried(np.zeros(grid.shape), still, 0.1, grid, Boundaries(), 2, (source,))
    assert dye.sum() == pytest.approx(6 * 0.8)
    assert (dye[box] == 0.8).all()
    away = uniform(grid, 1.0, 0.0, 0.0)
    # at 0.3 s the source is over, and the dye has moved on by a cell
    dye = carried(np.where(dye > 0, 0.8, 0.0), away, 0.1, grid, Boundaries(), 3, (source,))
    assert dye[4:7, 2:5].min() > 0.7
