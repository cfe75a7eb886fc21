"""Ghost values: interpolated to a side, they give what the side prescribes."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.ghosts import impose_sides, packed_sides, plane
from flowborne.fluid.grid import Grid
from flowborne.fluid.sides.far import BoundaryFar
from flowborne.fluid.sides.kinds import (
    BoundaryClosed,
    BoundaryInflow,
    BoundaryNoSlip,
    BoundaryOpen,
    BoundaryPeriodic,
)
from flowborne.fluid.sides.side import Boundary
from flowborne.kernels.arrays import FREE, Array, Faces
from flowborne.kernels.carry import fill_ghosts
from flowborne.kernels.flux import GHOSTS
from flowborne.motion.inflow import FactorRamp, FactorSteady, InflowProfile

SLAB = Grid.slab(6, 5, 0.5, (0.0, 1.0))
CUBE = Grid((6, 5, 4), 0.5, (0.0, 1.0, -1.0))


def random_faces(grid: Grid) -> Faces:
    random = np.random.default_rng(8)
    u, v, w = (random.normal(size=grid.face_shape(axis)) for axis in range(3))
    return u, v, w


def profile(x: Array, y: Array, z: Array, time: float) -> tuple[Array, Array, Array]:
    return y**2 + time + 0 * x, np.sin(y) + x + time, x * y + z


def with_ghosts(
    velocity: Faces, component: int, grid: Grid, sides: Boundaries, time: float
) -> Array:
    """A component with its layers of ghosts, in the order of the kernels' axes."""
    inside = plane(velocity[component], grid)
    field = np.pad(inside, [(GHOSTS * (n > 1),) * 2 for n in inside.shape])
    table = packed_sides(component, grid, sides, [time], grid.zeros_faces())
    fill_ghosts(field, table, 0, sides.faces(component, grid))
    return field


def layers(field: Array, axis: int, upper: bool, grid: Grid) -> Array:
    """Layers of a field with ghosts across an axis of the grid, from the outermost one on; without
    the ghosts of the other axes."""
    across = axis + grid.is_slab
    inside = [slice(GHOSTS, -GHOSTS) if n > 1 else slice(None) for n in field.shape]
    inside[across] = slice(None)
    found = np.moveaxis(field[tuple(inside)], across, 0)
    return found[::-1] if upper else found


def at_side(field: Array, axis: int, upper: bool, grid: Grid) -> list[Array]:
    """Mean of the n-th ghost and the n-th layer inside, for each n."""
    found = layers(field, axis, upper, grid)
    return [0.5 * (found[GHOSTS - 1 - n] + found[GHOSTS + n]) for n in range(GHOSTS)]


@pytest.mark.parametrize("grid", [SLAB, CUBE], ids=["slab", "cube"])
@pytest.mark.parametrize("upper", [False, True])
def test_a_sliding_wall_gives_its_own_velocity(grid: Grid, upper: bool) -> None:
    lid = BoundaryNoSlip((1.5, 0.0, -0.5))
    sides = Boundaries(y_max=lid) if upper else Boundaries(y_min=lid)
    for component in set(grid.axes) - {1}:
        field = with_ghosts(random_faces(grid), component, grid, sides, 0.0)
        for mean in at_side(field, 1, upper, grid):
            np.testing.assert_allclose(mean, lid.velocity[component], atol=1e-15)


@pytest.mark.parametrize("grid", [SLAB, CUBE], ids=["slab", "cube"])
def test_an_inflow_gives_its_profile_where_each_component_lives(grid: Grid) -> None:
    sides = Boundaries(x_min=BoundaryInflow(profile), x_max=BoundaryOpen())
    field = with_ghosts(random_faces(grid), 1, grid, sides, 2.0)
    y = grid.face_coordinates(1)[1]
    expected = np.sin(y) + grid.origin[0] + 2.0
    expected = expected[None] if grid.is_slab else expected[:, None]
    for mean in at_side(field, 0, False, grid):
        np.testing.assert_allclose(mean, np.broadcast_to(expected, mean.shape), atol=1e-14)


@pytest.mark.parametrize("side", [BoundaryClosed(), BoundaryOpen()], ids=["closed", "open"])
@pytest.mark.parametrize("upper", [False, True])
def test_closed_and_open_sides_continue_what_is_along_them(side: Boundary, upper: bool) -> None:
    """A closed one mirrors it, an open one holds it."""
    velocity = random_faces(CUBE)
    sides = Boundaries(x_max=side) if upper else Boundaries(x_min=side)
    for component in (1, 2):
        found = layers(with_ghosts(velocity, component, CUBE, sides, 0.0), 0, upper, CUBE)
        np.testing.assert_array_equal(found[1], found[2])
        np.testing.assert_array_equal(found[0], found[2] if side.normal == FREE else found[3])


@pytest.mark.parametrize("upper", [False, True])
def test_ghosts_across_a_side_hold_what_its_faces_do(upper: bool) -> None:
    field = with_ghosts(random_faces(CUBE), 2, CUBE, Boundaries(), 0.0)
    found = layers(field, 2, upper, CUBE)
    np.testing.assert_array_equal(found[:GHOSTS], np.stack([found[GHOSTS]] * GHOSTS))


def test_a_periodic_axis_continues_around_the_ring() -> None:
    ring = BoundaryPeriodic()
    sides = Boundaries(ring, ring, ring, ring, ring, ring)
    velocity = random_faces(CUBE)
    impose_sides(velocity, CUBE, sides, 0.0)
    for component in range(3):
        u = velocity[component]
        np.testing.assert_array_equal(u.take(0, component), u.take(-1, component))
        field = with_ghosts(velocity, component, CUBE, sides, 0.0)
        beyond = [(GHOSTS, GHOSTS + int(a == component)) for a in range(3)]
        wrapped = np.pad(np.delete(u, -1, component), beyond, mode="wrap")
        for axis in range(3):
            found, expected = (layers(f, axis, False, CUBE) for f in (field, wrapped))
            np.testing.assert_array_equal(found, expected)


def test_sides_impose_what_crosses_them() -> None:
    """Nothing at walls, the profile at an inflow, anything at an open side."""
    sides = Boundaries(BoundaryInflow(profile), BoundaryOpen(), BoundaryNoSlip((1.0, 0.0, 0.0)))
    velocity = random_faces(SLAB)
    before = [values.copy() for values in velocity]
    impose_sides(velocity, SLAB, sides, 3.0)
    y = SLAB.cell_coordinates()[1]
    np.testing.assert_allclose(velocity[0][0, :, 0], y**2 + 3.0, rtol=1e-14)
    np.testing.assert_array_equal(velocity[0][1:], before[0][1:])
    assert not velocity[1][:, [0, -1]].any()
    np.testing.assert_array_equal(velocity[1][:, 1:-1], before[1][:, 1:-1])


def test_sliding_is_along_the_wall_alone() -> None:
    lid = Boundaries(y_max=BoundaryNoSlip((1.0, 7.0, 0.0)))
    velocity = random_faces(SLAB)
    impose_sides(velocity, SLAB, lid, 0.0)
    assert not velocity[1][:, -1].any()


def test_what_steady_sides_prescribe_is_packed_once() -> None:
    """What crosses them is each step's own."""
    for factor, same in ((FactorSteady(), True), (FactorRamp(1.0), False)):
        inflow = BoundaryInflow(InflowProfile((1.0, 0.5, 0.0), factor))
        sides = Boundaries(inflow, BoundaryOpen(), BoundaryNoSlip())
        first, later = (packed_sides(1, SLAB, sides, [t], SLAB.zeros_faces()) for t in (0.2, 0.7))
        np.testing.assert_allclose(later.wall[0, : SLAB.face_shape(1)[1]], 0.5 * factor.at(0.7))
        assert (first.wall is later.wall) == same
        for values in (first.rate, first.share):
            assert not np.shares_memory(values, later.rate)
            assert not np.shares_memory(values, later.share)
    x, y = (BoundaryFar(),) * 2, (BoundaryFar(),) * 2
    assert Boundaries(*x, *y).steady_layers(SLAB) is None
