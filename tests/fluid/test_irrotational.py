"""What comes in through far sides has no vorticity."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.grid import Grid
from flowborne.fluid.sides.far import BoundaryFar
from flowborne.fluid.sides.kinds import BoundaryOpen
from flowborne.fluid.sides.side import Boundary, Place, tangential_change
from flowborne.fluid.transport import NO_INLETS, Transport, carry_component
from flowborne.kernels.arrays import Array, Faces
from flowborne.worlds import control_volumes

SLAB = Grid.slab(6, 5, 0.5, (0.0, 1.0))
CUBE = Grid((6, 5, 4), 0.5, (0.0, 1.0, -1.0))
FAR = BoundaryFar()


@pytest.mark.parametrize("upper", [False, True])
@pytest.mark.parametrize("periodic", [False, True])
def test_the_circulation_on_the_side_is_0(upper: bool, periodic: bool) -> None:
    """Across z, by pairs of components along x and y; at both ends as next to them."""
    place = Place(CUBE, 2, upper)
    normal = np.random.default_rng(8).normal(size=CUBE.face_shape(2))[place.layer]
    for component in (0, 1):
        change = tangential_change(normal, place, component, periodic)
        outward = change if upper else -change
        inside = np.delete(outward, [0, -1], component)
        np.testing.assert_array_equal(inside, np.diff(normal, axis=component))
        first, last = outward.take(0, component), outward.take(-1, component)
        if periodic:
            around = (normal.take(0, component) - normal.take(-1, component),) * 2
        else:
            around = inside.take(0, component), inside.take(-1, component)
        np.testing.assert_array_equal((first, last), around)


def strain(grid: Grid) -> Faces:
    """The irrotational flow (y, x), m/s."""
    u, v = grid.zeros_faces()[:2]
    u += grid.face_coordinates(0)[1][None, :, None]
    v += grid.face_coordinates(1)[0][:, None, None]
    return u, v, grid.zeros_faces()[2]


def carried(grid: Grid, side: Boundary = FAR) -> list[Array]:
    """Both components of it a step later."""
    sides = Boundaries(side, side, side, side)
    flow, opened = strain(grid), tuple(np.ones(grid.face_shape(axis)) for axis in range(3))
    volumes = control_volumes(np.full(grid.shape, grid.cell_volume), opened, grid, sides)
    flux = tuple(grid.face_area * u for u in flow)
    transport = Transport(flux, volumes, volumes, 0.05, 0.0)
    return [
        carry_component(flow[axis], None, axis, transport, NO_INLETS, grid, sides).velocity
        for axis in range(2)
    ]


def test_an_irrotational_flow_comes_in_as_it_is_outside() -> None:
    """In a domain six cells wider on all sides it is the same on the layers next to the sides
    where it comes in, but at their ends."""
    small, large = Grid.slab(20, 20, 0.1, (0.0, 0.0)), Grid.slab(32, 32, 0.1, (-0.6, -0.6))
    (u, v), (wide_u, wide_v) = carried(small), carried(large)
    np.testing.assert_allclose(v[0, 5:-5], wide_v[6, 11:-11], atol=3e-5)
    np.testing.assert_allclose(u[5:-5, 0], wide_u[11:-11, 6], atol=3e-5)
    mean = carried(small, BoundaryOpen())[1]
    assert np.abs(mean[0, 5:-5] - wide_v[6, 11:-11]).max() > 1e-2
