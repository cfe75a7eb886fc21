"""What vorticity, its images and sources induce on the sides of a slab and of a room."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.fluid.boundary import places
from flowborne.fluid.grid import Grid
from flowborne.fluid.potential import (
    OnEdges,
    circulations,
    edges_of,
    normal_velocity,
    potentials,
    source_velocity,
)
from flowborne.fluid.sides.side import Place
from flowborne.kernels.arrays import Array, Faces

SLAB = Grid.slab(11, 7, 0.5, (-1.0, 2.0))
ROOM = Grid((7, 5, 6), 0.5, (-1.0, 2.0, 0.0))
ALL_SIDES = [*places(SLAB), *places(ROOM)]


def flow(grid: Grid) -> Faces:
    random = np.random.default_rng(4)
    u, v, w = (random.normal(size=grid.face_shape(axis)) for axis in range(3))
    return u, v, w


def vortices(grid: Grid) -> OnEdges:
    return circulations(flow(grid), grid)


def edges_inside(grid: Grid, axis: int) -> Array:
    """(n, d) middles of all edges along an axis, m."""
    along = [
        grid.origin[a] + grid.spacing * (np.arange(grid.shape[a] + (a != axis)) + 0.5 * (a == axis))
        for a in range(3)
    ]
    found = np.meshgrid(*along, indexing="ij")
    return np.stack([found[a].ravel() for a in grid.axes], axis=1)


def direct(grid: Grid, place: Place) -> OnEdges:
    """A on the edges of a side by the sum over all edges."""
    found = {}
    for axis, circulation in vortices(grid).items():
        if axis == place.axis:
            continue
        nodes, own = edges_of(place, axis), circulation.ravel()
        away = np.linalg.norm(nodes[:, None] - edges_inside(grid, axis), axis=2)
        away = np.where((own == 0.0) | (away == 0.0), 1.0, away)
        one = -np.log(away) / (2.0 * np.pi) if grid.is_slab else 0.5 / away / (4.0 * np.pi)
        layer = [1 if a == place.axis else n + (a != axis) for a, n in enumerate(grid.shape)]
        found[axis] = (one @ own).reshape(layer)
    return found


@pytest.mark.parametrize("place", ALL_SIDES, ids=str)
def test_the_transforms_give_the_sum_over_all_edges(place: Place) -> None:
    """In a slab up to a constant."""
    found, expected = (
        potentials(vortices(place.grid), place.grid, ())[place],
        direct(place.grid, place),
    )
    if not place.grid.is_slab:
        for axis, values in expected.items():
            np.testing.assert_allclose(found[axis], values, atol=1e-13)
    velocities = (normal_velocity(of, place) for of in (found, expected))
    np.testing.assert_allclose(*velocities, atol=1e-13)


def outflow(place: Place, across: Array) -> float:
    return float(across.sum()) * (1.0 if place.upper else -1.0)


@pytest.mark.parametrize("grid", [SLAB, ROOM], ids=["slab", "room"])
def test_no_fluid_appears(grid: Grid) -> None:
    across = {p: normal_velocity(a, p) for p, a in potentials(vortices(grid), grid, ()).items()}
    assert abs(sum(outflow(*row) for row in across.items())) < (1e-13 if grid.is_slab else 1e-12)
    assert max(np.abs(values).max() for values in across.values()) > 0.1


def test_a_uniform_flow_has_no_circulation_and_a_rotation_twice_its_rate() -> None:
    u, v, w = SLAB.zeros_faces()
    x, y = SLAB.face_coordinates(1)[0], SLAB.face_coordinates(0)[1]
    u += 3.0 - 0.7 * y[None, :, None]
    v += 2.0 + 0.7 * x[:, None, None]
    found = circulations((u, v, w), SLAB)[2]
    np.testing.assert_allclose(found[1:-1, 1:-1], 1.4 * 0.25, atol=1e-13)
    assert not found[0].any()
    assert not found[:, -1].any()


def test_a_ring_of_vorticity_induces_what_a_dipole_does_far_away() -> None:
    """Round one face: moment G h^2 along its normal."""
    grid = Grid((15, 15, 15), 1.0)
    velocity = grid.zeros_faces()
    velocity[0][8, 7, 7] = 1.0
    place = Place(grid, 0, True)
    across = normal_velocity(potentials(circulations(velocity, grid), grid, ())[place], place)
    assert across[0, 7, 7] == pytest.approx(2.0 / (4.0 * np.pi * 7.0**3), rel=0.03)


@pytest.mark.parametrize("mirror", ALL_SIDES, ids=str)
def test_nothing_crosses_a_mirror(mirror: Place) -> None:
    grid = mirror.grid
    far = Place(grid, (mirror.axis + 1) % len(grid.axes), True)
    with_mirror, alone = (potentials(vortices(grid), grid, m) for m in ((mirror,), ()))
    np.testing.assert_allclose(normal_velocity(with_mirror[mirror], mirror), 0.0, atol=1e-12)
    change = normal_velocity(with_mirror[far], far) - normal_velocity(alone[far], far)
    assert np.abs(change).max() > 0.01


@pytest.mark.parametrize(
    ("grid", "points"),
    [(SLAB, [[0.3, 3.1], [2.2, 4.0]]), (ROOM, [[0.3, 3.1, 1.0], [2.2, 4.0, 2.9]])],
    ids=["slab", "room"],
)
def test_what_a_source_brings_goes_through_the_sides(grid: Grid, points: list[list[float]]) -> None:
    rates = np.array([2.0, -0.5])
    across = {p: source_velocity(np.array(points), rates, p) for p in places(grid)}
    flux = grid.face_area * sum(outflow(*row) for row in across.items())
    assert flux == pytest.approx(1.5, rel=1e-12)
