"""The wake beyond the exit of a room: bins of circulation and moments on a line."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.grid import Array, Grid
from flowborne.fluid.induced import after_move
from flowborne.fluid.sea import Sea
from flowborne.fluid.sea_room import (
    edge_circulation,
    edges_of,
    grouped,
    images,
    leaving,
    potential,
    source_rate,
)
from flowborne.fluid.sides.far import BoundaryFar
from flowborne.fluid.sides.kinds import BoundaryClosed
from flowborne.fluid.sides.side import Place
from flowborne.fluid.wake import BINS, wake_line

GRID = Grid((8, 6, 6), 0.5, (-1.0, -1.5, -1.5))
FAR = BoundaryFar((1.0, 0.0, 0.0))


def sea(*velocity: float) -> Sea:
    found = Boundaries(*(BoundaryFar((velocity[0], velocity[1], velocity[2])),) * 6).sea(GRID)
    assert found is not None
    return found


def of_vortices(places: Array, vorticity: Array, edges: Array, axis: int) -> Array:
    """Component of A of vortices (n, 3) of strength (n, 3) at places (n, 3)."""
    away = np.linalg.norm(edges[:, None] - places, axis=2)
    return np.asarray((1.0 / away) @ vorticity[:, axis] / (4.0 * np.pi))


def binned(middle: Array, places: Array, vorticity: Array) -> Array:
    """(12,) G and M of vortices about the middle of a bin."""
    moment = np.einsum("nj,ni->ji", places - middle, vorticity)
    return np.concatenate([vorticity.sum(axis=0), moment.ravel()])


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize(("number", "within"), [(3, 2e-3), (30, 2e-3)])
def test_bins_induce_what_their_vortices_do(axis: int, number: int, within: float) -> None:
    line, random = wake_line(sea(2.0, 1.0, -0.5)), np.random.default_rng(7)
    places = line.middles[number] + 0.5 * random.normal(size=(6, 3))
    vorticity, bins = random.normal(size=(6, 3)), np.zeros((BINS, 12))
    bins[number] = binned(line.middles[number], places, vorticity)
    edges = edges_of(Place(GRID, (axis + 1) % 3, False), axis)
    found = potential(grouped(line, bins), edges, axis)
    expected = of_vortices(places, vorticity, edges, axis)
    np.testing.assert_allclose(found, expected, atol=within * np.abs(expected).max() + 1e-5)


def test_images_behind_mirrors_are_those_of_the_vortices() -> None:
    """A quarter of a wake between two mirrors."""
    place = Place(GRID, 1, False), Place(GRID, 2, False)
    random = np.random.default_rng(3)
    places, vorticity = random.uniform(0.1, 1.0, (5, 3)), random.normal(size=(5, 3))
    all_places, all_vorticity = places, vorticity
    for mirror in place:
        turn = np.ones(3)
        turn[mirror.axis] = -1.0
        all_places = np.concatenate([all_places, all_places * turn])
        all_vorticity = np.concatenate([all_vorticity, -all_vorticity * turn])
    found = images(place) * binned(np.zeros(3), places, vorticity)
    np.testing.assert_allclose(found, binned(np.zeros(3), all_places, all_vorticity), atol=1e-13)


def test_what_a_wake_lacks_is_the_source_at_its_end() -> None:
    """A wake that is slower by 0.2 m/s on 3 x 3 faces of 0.25 m^2 lacks 0.45 m^3/s."""
    velocity = GRID.zeros_faces()
    velocity[0][:] = 1.0
    velocity[0][:, 1:4, 2:5] = 0.8
    circulation = tuple(edge_circulation(velocity, GRID, axis) for axis in range(3))
    line = wake_line(sea(1.0, 0.0, 0.0))
    rate, speed = leaving(circulation, velocity, Place(GRID, 0, True), line)
    assert speed == pytest.approx(0.9)
    np.testing.assert_allclose(rate[:3], 0.0, atol=1e-13)
    bins = np.zeros((BINS, 12))
    bins[-1] = rate / 0.9 * line.length
    assert source_rate(line, bins) == pytest.approx(0.45)


@pytest.mark.parametrize("upper", [False, True])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_what_leaves_has_the_circulation_of_the_layer_next_to_the_exit(
    axis: int, upper: bool
) -> None:
    """In a uniform flow out of the exit, times its speed."""
    random = np.random.default_rng(1)
    velocity = tuple(0.01 * random.normal(size=GRID.face_shape(a)) for a in range(3))
    circulation = tuple(edge_circulation(velocity, GRID, a) for a in range(3))
    stream = np.zeros(3)
    stream[axis] = 2.0 if upper else -2.0
    uniform = tuple(np.full(GRID.face_shape(a), stream[a]) for a in range(3))
    rate, speed = leaving(circulation, uniform, Place(GRID, axis, upper), wake_line(sea(*stream)))
    assert speed == pytest.approx(2.0)
    for i in range(3):
        at = (-1 if i == axis else -2) if upper else int(i != axis)
        assert rate[i] == pytest.approx(2.0 * circulation[i].take(at, axis).sum())
    assert np.abs(rate[3:]).max() > 0.0
    np.testing.assert_allclose(rate[3 + 3 * axis : 6 + 3 * axis], 0.0, atol=1e-14)


def test_beside_mirrors_the_line_is_on_both() -> None:
    wall = BoundaryClosed()
    found = Boundaries(FAR, FAR, wall, FAR, wall, FAR).sea(GRID)
    assert found is not None
    np.testing.assert_allclose(wake_line(found).start, (3.0, -1.5, -1.5))


@pytest.mark.parametrize("way", [(8, 0, 0), (-8, 0, 0), (0, 5, -4), (-3, -2, 1)])
def test_the_wake_stays_in_the_world_when_the_domain_moves(way: tuple[int, int, int]) -> None:
    """Far from it its potential is the same from the domain's old place and the new."""
    sides = Boundaries(*(BoundaryFar((2.0, 0.0, 0.0)),) * 6)
    grid = Grid((16, 16, 16), 0.1, (0.0, 0.0, 0.0))
    bins = np.zeros((6, BINS, 12))
    bump = np.exp(-((np.arange(BINS) - 20) ** 2) / 20.0)
    bins[1] = bump[:, None] * np.random.default_rng(6).normal(size=12)
    bins[1, :, 3:6] = 0.0
    away = np.array([[-30.0, 20.0, 11.0], [100.0, -40.0, 30.0], [-50.0, -30.0, -70.0]])

    def induced(grid: Grid, wake: Array, axis: int) -> Array:
        sea = sides.sea(grid)
        assert sea is not None
        return potential(grouped(wake_line(sea), wake[1]), away, axis)

    here, wake = grid, bins
    for axis, cells in enumerate(way):
        for _ in range(abs(cells)):
            there = here.moved(axis, int(np.sign(cells)))
            before, after = sides.sea(here), sides.sea(there)
            assert before is not None
            assert after is not None
            wake, here = after_move(wake, grid.zeros_faces(), before, after), there
    for axis in range(3):
        assert induced(here, wake, axis) == pytest.approx(induced(grid, bins, axis), rel=5e-3)


def test_what_the_exit_leaves_behind_goes_into_the_wake() -> None:
    sides = Boundaries(*(FAR,) * 6)
    velocity = GRID.zeros_faces()
    velocity[0][-2, 3, 4] = 1.0
    seas = sides.sea(GRID), sides.sea(GRID.moved(0, -1))
    assert seas[0] is not None
    assert seas[1] is not None
    wake = after_move(np.zeros((6, BINS, 12)), velocity, *seas)[1]
    np.testing.assert_allclose(wake[0, :3], 0.0, atol=1e-14)
    assert wake[0, 3:].reshape(3, 3)[1, 2] == pytest.approx(0.5**3)
    assert wake[0, 3:].reshape(3, 3)[2, 1] == pytest.approx(-(0.5**3))
    assert not wake[1:].any()
