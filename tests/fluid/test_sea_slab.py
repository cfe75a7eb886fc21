"""What vorticity, its images and sources induce on the sides of a slab."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.fluid.boundary import places
from flowborne.fluid.grid import Array, Grid
from flowborne.fluid.sea_slab import (
    node_circulation,
    nodes_of,
    normal_velocity,
    source_velocity,
    stream_functions,
)
from flowborne.fluid.sides.side import Place

GRID = Grid.slab(11, 7, 0.5, (-1.0, 2.0))


def circulations() -> Array:
    found = np.zeros((12, 8))
    found[1:-1, 1:-1] = np.random.default_rng(4).normal(size=(10, 6))
    return found


def direct(nodes: Array, circulation: Array) -> Array:
    """The stream function at nodes (n, 2) by the sum over all vortices."""
    x = GRID.origin[0] + GRID.spacing * np.arange(12)
    y = GRID.origin[1] + GRID.spacing * np.arange(8)
    square = np.add.outer(nodes[:, 0], -x)[:, :, None] ** 2
    square = square + np.add.outer(nodes[:, 1], -y)[:, None, :] ** 2
    logs = np.log(np.where(square > 0.0, square, 1.0))
    return -np.einsum("nij,ij->n", logs, circulation) / (4.0 * np.pi)


@pytest.mark.parametrize("place", places(GRID), ids=str)
def test_the_transforms_give_the_sum_over_all_vortices(place: Place) -> None:
    circulation = circulations()
    found = normal_velocity(stream_functions(circulation, GRID, ())[place], place)
    expected = normal_velocity(direct(nodes_of(place), circulation), place)
    np.testing.assert_allclose(found, expected, atol=1e-13)


def outflow(place: Place, across: Array) -> float:
    return float(across.sum()) * (1.0 if place.upper else -1.0)


def test_no_fluid_appears() -> None:
    sides = stream_functions(circulations(), GRID, ())
    across = {place: normal_velocity(values, place) for place, values in sides.items()}
    assert abs(sum(outflow(*row) for row in across.items())) < 1e-13


def test_a_uniform_flow_has_no_circulation_and_a_rotation_twice_its_rate() -> None:
    u, v, w = GRID.zeros_faces()
    x, y = GRID.face_coordinates(1)[0], GRID.face_coordinates(0)[1]
    u += 3.0 - 0.7 * y[None, :, None]
    v += 2.0 + 0.7 * x[:, None, None]
    found = node_circulation((u, v, w), GRID)
    np.testing.assert_allclose(found[1:-1, 1:-1], 1.4 * 0.25, atol=1e-13)
    assert not found[0].any()
    assert not found[:, -1].any()


@pytest.mark.parametrize("upper", [False, True])
@pytest.mark.parametrize("axis", [0, 1])
def test_nothing_crosses_a_mirror(axis: int, upper: bool) -> None:
    mirror, far = Place(GRID, axis, upper), Place(GRID, 1 - axis, True)
    sides = stream_functions(circulations(), GRID, (mirror,))
    np.testing.assert_allclose(normal_velocity(sides[mirror], mirror), 0.0, atol=1e-13)
    alone = normal_velocity(stream_functions(circulations(), GRID, ())[far], far)
    assert np.abs(normal_velocity(sides[far], far) - alone).max() > 0.01


def test_what_a_source_brings_goes_through_the_sides() -> None:
    points, rates = np.array([[0.3, 3.1], [2.2, 4.0]]), np.array([2.0, -0.5])
    flux = sum(0.5 * outflow(p, source_velocity(points, rates, p)) for p in places(GRID))
    assert flux == pytest.approx(1.5, rel=1e-13)
