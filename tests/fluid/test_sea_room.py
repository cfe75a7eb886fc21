"""What vorticity, its images and sources induce on the sides of a room."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.fluid.boundary import places
from flowborne.fluid.grid import Array, Faces, Grid
from flowborne.fluid.sea_room import (
    edge_circulation,
    edges_of,
    normal_velocity,
    potentials,
    source_velocity,
)
from flowborne.fluid.sides.side import Place

GRID = Grid((7, 5, 6), 0.5, (-1.0, 2.0, 0.0))


def flow() -> Faces:
    random = np.random.default_rng(4)
    u, v, w = (random.normal(size=GRID.face_shape(axis)) for axis in range(3))
    return u, v, w


def circulations(velocity: Faces, grid: Grid) -> Faces:
    x, y, z = (edge_circulation(velocity, grid, axis) for axis in range(3))
    return x, y, z


def edges_inside(axis: int) -> Array:
    """(n, 3) middles of all edges along an axis, m."""
    along = [
        GRID.origin[a] + 0.5 * (np.arange(GRID.shape[a] + (a != axis)) + 0.5 * (a == axis))
        for a in range(3)
    ]
    return np.stack([c.ravel() for c in np.meshgrid(*along, indexing="ij")], axis=1)


@pytest.mark.parametrize("place", places(GRID), ids=str)
def test_the_transforms_give_the_sum_over_all_edges(place: Place) -> None:
    found = potentials(circulations(flow(), GRID), GRID, ())[place]
    for axis in set(range(3)) - {place.axis}:
        circulation = edge_circulation(flow(), GRID, axis).ravel()
        nodes = edges_of(place, axis)
        away = np.linalg.norm(nodes[:, None] - edges_inside(axis), axis=2)
        weights = np.where(circulation == 0.0, 0.0, 1.0) / np.where(away > 0.0, away, 1.0)
        expected = 0.5 * weights @ circulation / (4.0 * np.pi)
        np.testing.assert_allclose(found[axis].ravel(), expected, atol=1e-13)


def outflow(place: Place, across: Array) -> float:
    return float(across.sum()) * (1.0 if place.upper else -1.0)


def test_no_fluid_appears() -> None:
    across = {
        p: normal_velocity(a, p)
        for p, a in potentials(circulations(flow(), GRID), GRID, ()).items()
    }
    assert abs(sum(outflow(*row) for row in across.items())) < 1e-12
    assert max(np.abs(values).max() for values in across.values()) > 0.1


def test_a_ring_of_vorticity_induces_what_a_dipole_does_far_away() -> None:
    """Round one face: moment G h^2 along its normal."""
    grid, (u, v, w) = (
        Grid((15, 15, 15), 1.0),
        (np.zeros(s) for s in ((16, 15, 15), (15, 16, 15), (15, 15, 16))),
    )
    u[8, 7, 7] = 1.0
    place = Place(grid, 0, True)
    found = normal_velocity(potentials(circulations((u, v, w), grid), grid, ())[place], place)[
        0, 7, 7
    ]
    assert found == pytest.approx(2.0 / (4.0 * np.pi * 7.0**3), rel=0.03)


@pytest.mark.parametrize("upper", [False, True])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_nothing_crosses_a_mirror(axis: int, upper: bool) -> None:
    mirror, far = Place(GRID, axis, upper), Place(GRID, (axis + 1) % 3, True)
    with_mirror, alone = (
        potentials(circulations(flow(), GRID), GRID, (mirror,)),
        potentials(circulations(flow(), GRID), GRID, ()),
    )
    np.testing.assert_allclose(normal_velocity(with_mirror[mirror], mirror), 0.0, atol=1e-12)
    assert (
        np.abs(normal_velocity(with_mirror[far], far) - normal_velocity(alone[far], far)).max()
        > 0.01
    )


def test_what_a_source_brings_goes_through_the_sides() -> None:
    points, rates = np.array([[0.3, 3.1, 1.0], [2.2, 4.0, 2.9]]), np.array([2.0, -0.5])
    flux = sum(0.25 * outflow(p, source_velocity(points, rates, p)) for p in places(GRID))
    assert flux == pytest.approx(1.5, rel=1e-12)
