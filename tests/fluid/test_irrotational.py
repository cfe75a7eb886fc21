"""What comes in through far sides has no vorticity."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.ghosts import pad_faces
from flowborne.fluid.grid import Array, Faces, Grid
from flowborne.fluid.sides.far import BoundaryFar
from flowborne.fluid.sides.open import BoundaryOpen
from flowborne.fluid.sides.periodic import BoundaryPeriodic
from flowborne.fluid.sides.side import Boundary
from flowborne.fluid.transport import NO_INLETS, Transport, carry_component
from flowborne.worlds import control_volumes

SLAB = Grid.slab(6, 5, 0.5, (0.0, 1.0))
CUBE = Grid((6, 5, 4), 0.5, (0.0, 1.0, -1.0))
FAR, RING = BoundaryFar(), BoundaryPeriodic()


def random_faces(grid: Grid) -> Faces:
    random = np.random.default_rng(8)
    u, v, w = (random.normal(size=grid.face_shape(axis)) for axis in range(3))
    return u, v, w


@pytest.mark.parametrize("upper", [False, True])
@pytest.mark.parametrize("end", [FAR, RING], ids=lambda side: side.kind)
def test_the_circulation_on_the_side_is_0_where_fluid_comes_in(upper: bool, end) -> None:
    """And what leaves keeps its velocity; across z, by pairs of components along x and y."""
    sides = Boundaries(end, end, FAR, FAR, FAR, FAR)
    velocity = random_faces(CUBE)
    velocity[0][-1] = velocity[0][0]
    padded = pad_faces(velocity, CUBE, sides, 0.0)
    normal = velocity[2][:, :, -1 if upper else 0]
    ghost, inner = (-1, -2) if upper else (0, 1)
    for component in (0, 1):
        wrapped = np.pad(normal, 1, mode="wrap" if end is RING and component == 0 else "edge")
        across = np.diff(padded[component][1:-1, 1:-1, [ghost, inner]], axis=2)[:, :, 0]
        across = -across if upper else across
        wrapped = np.delete(wrapped, [0, -1], 1 - component)
        low, high = np.delete(wrapped, -1, component), np.delete(wrapped, 0, component)
        inward = (low + high > 0.0) != upper
        whole = np.delete(np.arange(across.shape[component]), [0, -1])
        if end is RING and component == 0:
            whole = np.arange(across.shape[component])
        found, expected, inward = (f.take(whole, component) for f in (across, high - low, inward))
        np.testing.assert_allclose(found[inward], expected[inward], atol=1e-14)
        assert not found[~inward].any()


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
