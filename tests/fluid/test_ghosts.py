"""Ghost values: interpolated to a side, they give what the side prescribes."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.ghosts import impose_sides, pad_cells, pad_faces
from flowborne.fluid.grid import Array, Faces, Grid
from flowborne.fluid.sides.closed import BoundaryClosed
from flowborne.fluid.sides.inflow import BoundaryInflow
from flowborne.fluid.sides.no_slip import BoundaryNoSlip
from flowborne.fluid.sides.open import BoundaryOpen
from flowborne.fluid.sides.periodic import BoundaryPeriodic
from flowborne.fluid.sides.side import Boundary

SLAB = Grid.slab(6, 5, 0.5, (0.0, 1.0))
CUBE = Grid((6, 5, 4), 0.5, (0.0, 1.0, -1.0))


def random_faces(grid: Grid) -> Faces:
    random = np.random.default_rng(8)
    u, v, w = (random.normal(size=grid.face_shape(axis)) for axis in range(3))
    return u, v, w


def profile(x: Array, y: Array, z: Array, time: float) -> tuple[Array, Array, Array]:
    return y**2 + time + 0 * x, np.sin(y) + x + time, x * y + z


def at_side(field: Array, axis: int, upper: bool) -> Array:
    """Value half-way between the last two layers of a padded field, ghosts of other axes off."""
    inside = tuple(slice(None) if a == axis else slice(1, -1) for a in range(3))
    layers = np.moveaxis(field[inside] if field.shape[2] > 2 else field[inside[:2]], axis, 0)
    near, far = (layers[-2], layers[-1]) if upper else (layers[1], layers[0])
    return 0.5 * (near + far)


@pytest.mark.parametrize("grid", [SLAB, CUBE], ids=["slab", "cube"])
@pytest.mark.parametrize("upper", [False, True])
def test_a_sliding_wall_gives_its_own_velocity(grid: Grid, upper: bool) -> None:
    lid = BoundaryNoSlip((1.5, 0.0, -0.5))
    sides = Boundaries(y_max=lid) if upper else Boundaries(y_min=lid)
    padded = pad_faces(random_faces(grid), grid, sides, 0.0)
    np.testing.assert_allclose(at_side(padded[0], 1, upper), 1.5, atol=1e-15)
    if not grid.is_slab:
        np.testing.assert_allclose(at_side(padded[2], 1, upper), -0.5, atol=1e-15)
    rates = pad_faces(random_faces(grid), grid, sides, 0.0, rate=True)
    np.testing.assert_allclose(at_side(rates[0], 1, upper), 0.0, atol=1e-15)


@pytest.mark.parametrize("grid", [SLAB, CUBE], ids=["slab", "cube"])
def test_an_inflow_gives_its_profile_where_each_component_lives(grid: Grid) -> None:
    sides = Boundaries(x_min=BoundaryInflow(profile), x_max=BoundaryOpen())
    padded = pad_faces(random_faces(grid), grid, sides, 2.0)
    y = grid.face_coordinates(1)[1]
    expected = np.sin(y) + grid.origin[0] + 2.0
    found = at_side(padded[1], 0, False)
    np.testing.assert_allclose(
        found,
        np.broadcast_to(expected.reshape((-1, *[1] * (found.ndim - 1))), found.shape),
        atol=1e-14,
    )


@pytest.mark.parametrize("side", [BoundaryClosed(), BoundaryOpen()], ids=["closed", "open"])
@pytest.mark.parametrize("upper", [False, True])
def test_closed_and_open_sides_continue_what_is_along_them(side: Boundary, upper: bool) -> None:
    velocity = random_faces(CUBE)
    sides = Boundaries(x_max=side) if upper else Boundaries(x_min=side)
    padded = pad_faces(velocity, CUBE, sides, 0.0)
    ghost, inner = (-1, -2) if upper else (0, 1)
    for component in (1, 2):
        np.testing.assert_array_equal(padded[component][ghost], padded[component][inner])


def test_a_periodic_axis_continues_around_the_ring() -> None:
    ring = BoundaryPeriodic()
    sides = Boundaries(ring, ring, ring, ring, ring, ring)
    velocity = random_faces(CUBE)
    impose_sides(velocity, CUBE, sides, 0.0)
    padded = pad_faces(velocity, CUBE, sides, 0.0)
    values = np.random.default_rng(1).random(CUBE.shape)
    cells = pad_cells(values, CUBE, sides)
    for axis in range(3):
        np.testing.assert_array_equal(velocity[axis].take(0, axis), velocity[axis].take(-1, axis))
        wrapped = np.pad(
            np.delete(velocity[axis], -1, axis),
            [(1, 1) if a != axis else (1, 2) for a in range(3)],
            mode="wrap",
        )
        np.testing.assert_array_equal(padded[axis], wrapped)
    np.testing.assert_array_equal(cells, np.pad(values, 1, mode="wrap"))


def test_cells_have_zero_gradient_at_every_other_side() -> None:
    values = np.random.default_rng(1).random(SLAB.shape)
    sides = Boundaries(BoundaryInflow(profile), BoundaryOpen(), BoundaryNoSlip(), BoundaryClosed())
    np.testing.assert_array_equal(
        pad_cells(values, SLAB, sides), np.pad(values, [(1, 1), (1, 1), (0, 0)], mode="edge")
    )


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
