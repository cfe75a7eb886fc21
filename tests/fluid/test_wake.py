"""The wake beyond the exit of a slab and of a room: bins of circulation and moments on a line."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.grid import Grid
from flowborne.fluid.potential import circulations, edges_of
from flowborne.fluid.sides.far import BoundaryFar, Sea
from flowborne.fluid.sides.kinds import BoundaryClosed
from flowborne.fluid.sides.side import Place
from flowborne.fluid.wake import (
    BIN,
    BINS,
    after_move,
    images,
    leaving,
    moved,
    potential,
    resampled,
    source_rate,
    stream_function,
    wake_line,
    with_all_circulation_0,
)
from flowborne.kernels.arrays import Array

GRID = Grid.slab(12, 8, 0.5, (-1.0, 2.0))
ROOM = Grid((8, 6, 6), 0.5, (-1.0, -1.5, -1.5))
FAR = BoundaryFar((1.0, 0.0, 0.0))


def sea(*velocity: float) -> Sea:
    """Around the slab or the room, by the number of components."""
    u, v, w = (*velocity, 0.0)[:3]
    grid = GRID if len(velocity) == 2 else ROOM
    found = Boundaries(*(BoundaryFar((u, v, w)),) * (2 * len(grid.axes))).sea(grid)
    assert found is not None
    return found


@pytest.mark.parametrize(
    ("velocity", "start"),
    [((2.0, 0.0), (5.0, 4.0)), ((-1.0, 0.5), (-1.0, 5.5)), ((0.0, 3.0), (2.0, 6.0))],
)
def test_it_begins_where_the_stream_through_the_middle_leaves(
    velocity: tuple[float, float], start: tuple[float, float]
) -> None:
    line = wake_line(sea(*velocity))
    np.testing.assert_allclose(line.start, start)
    np.testing.assert_allclose(line.along, np.array(velocity) / np.hypot(*velocity))
    assert line.length == BIN * GRID.spacing


def test_beside_a_mirror_it_is_on_the_mirror() -> None:
    far = BoundaryFar((1.0, 0.0, 0.0))
    found = Boundaries(far, far, BoundaryClosed(), far).sea(GRID)
    assert found is not None
    np.testing.assert_allclose(wake_line(found).start, (5.0, 2.0))


def test_far_away_bins_induce_what_their_vortices_do() -> None:
    """A pair of vortices in one bin, 40 bins away from the exit."""
    line = wake_line(sea(1.0, 0.5))
    bins, nodes = np.zeros((BINS, 2)), edges_of(Place(GRID, 1, False), 2)
    offsets, vortices = np.array([0.4, -0.2]), np.array([1.0, -0.7])
    bins[40] = vortices.sum(), vortices @ offsets
    places = line.middles[40] + offsets[:, None] * line.across
    away = np.linalg.norm(nodes[:, None] - places, axis=2)
    expected = -np.log(away) @ vortices / (2.0 * np.pi)
    found = stream_function(line, bins, nodes)
    np.testing.assert_allclose(np.diff(found), np.diff(expected), rtol=1e-4)


def test_the_last_bin_goes_on_for_ever() -> None:
    """As a source whose flux is that of twice as many bins, and one behind those."""
    line, nodes = wake_line(sea(1.0, 0.0)), edges_of(Place(GRID, 1, True), 2)
    bins = np.zeros((BINS, 2))
    bins[:, 1] = 0.3
    found = np.diff(stream_function(line, bins, nodes))
    many = line.start + np.multiply.outer(line.length * (np.arange(100 * BINS) + 0.5), line.along)
    away = nodes[:, None] - many
    square = (away**2).sum(axis=2)
    expected = np.diff((0.3 * (away @ line.across) / square).sum(axis=1) / (2.0 * np.pi))
    np.testing.assert_allclose(found, expected, rtol=0.02)


def test_what_leaves_goes_on_and_is_kept() -> None:
    """Circulation and moment of a column of vortices next to the exit that moves with the flow."""
    velocity = GRID.zeros_faces()
    velocity[0][:] = 2.0
    velocity[1][-1:, 3] = 0.25
    circulation, place = circulations(velocity, GRID), Place(GRID, 0, True)
    line = wake_line(sea(1.0, 0.0))
    rate, speed = leaving(circulation, velocity, place, line)
    total = circulation[2][-2].sum()
    assert speed == pytest.approx(2.0)
    np.testing.assert_allclose(rate, [4.0 * total, 4.0 * total * -0.5])
    bins = moved(np.zeros((BINS, 2)), 0.25 * rate, 0.1)
    for _ in range(100):
        bins = moved(bins, np.zeros(2), 0.1)
    np.testing.assert_allclose(bins.sum(axis=0), 0.25 * rate)
    assert np.average(np.arange(BINS), weights=np.abs(bins[:, 0])) == pytest.approx(10.0, abs=0.1)


def test_all_circulation_adds_up_to_0() -> None:
    bins = np.random.default_rng(2).normal(size=(BINS, 2))
    closed = with_all_circulation_0(bins, np.array([0.75]))
    assert closed[:, 0].sum() == pytest.approx(-0.75)
    np.testing.assert_array_equal(closed[1:], bins[1:])
    np.testing.assert_array_equal(closed[:, 1], bins[:, 1])


@pytest.mark.parametrize("way", [(8, 0), (-8, 0), (0, 5), (-3, -2)])
def test_the_wake_stays_in_the_world_when_the_domain_moves(way: tuple[int, int]) -> None:
    """Far from the wake its stream function is the same from the domain's old place and the new."""
    sides = Boundaries(*(BoundaryFar(velocity=(2.0, 0.0, 0.0)),) * 4)
    grid = Grid.slab(32, 32, 0.1, (0.0, 0.0))
    bins = np.zeros((4, BINS, 2))
    bump = np.exp(-((np.arange(BINS) - 20) ** 2) / 20.0)
    bins[1, :, 0], bins[1, :, 1] = bump, 3.0 * bump
    far = np.array([[-300.0, 200.0], [100.0, -400.0], [-50.0, -300.0]])

    def induced(grid: Grid, wake: Array) -> Array:
        sea = sides.sea(grid)
        assert sea is not None
        return stream_function(wake_line(sea), wake[1], far)

    still, here, wake = grid.zeros_faces(), grid, bins
    for axis, cells in enumerate(way):
        for _ in range(abs(cells)):
            there = here.moved(axis, int(np.sign(cells)))
            wake = after_move(wake, still, sides.sea(here), sides.sea(there))
            here = there
    assert induced(here, wake) == pytest.approx(induced(grid, bins), rel=2e-3)


def test_what_the_exit_leaves_behind_goes_into_the_wake() -> None:
    sides = Boundaries(*(BoundaryFar(velocity=(2.0, 0.0, 0.0)),) * 4)
    grid = Grid.slab(16, 16, 0.1, (0.0, 0.0))
    velocity = grid.zeros_faces()
    velocity[0][-2, 9] = 1.0
    seas = sides.sea(grid), sides.sea(grid.moved(0, -1))
    wake = after_move(np.zeros((4, BINS, 2)), velocity, *seas)
    assert wake[1, 0] == pytest.approx([0.0, 0.1 * 0.1 * 1.0])
    assert not wake[1, 1:].any()


@pytest.mark.parametrize("ratio", [0.5, 1.0, 0.7, 2.0])
def test_bins_of_another_grid_have_the_same_wake(ratio: float) -> None:
    """What lies between the exit and a distance from it, up to where both lines reach."""
    bins = np.random.default_rng(1).normal(size=(4, BINS, 2))
    found = resampled(bins, ratio)
    ends = np.arange(1, BINS + 1)
    sums = np.cumsum(bins, axis=1)[2, :, 1]
    known = np.interp(ratio * ends, np.arange(BINS + 1), np.concatenate([[0.0], sums]))
    inside = ratio * ends <= BINS
    assert np.cumsum(found, axis=1)[2, inside, 1] == pytest.approx(known[inside])
    assert found[:, -1] == pytest.approx(ratio * bins[:, -1] if ratio > 1.0 else found[:, -1])


def test_no_bins_stay_none() -> None:
    assert resampled(np.zeros((0, 0, 0)), 0.5).shape == (0, 0, 0)


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
    edges = edges_of(Place(ROOM, (axis + 1) % 3, False), axis)
    found = potential(line, bins, edges, axis)
    expected = of_vortices(places, vorticity, edges, axis)
    np.testing.assert_allclose(found, expected, atol=within * np.abs(expected).max() + 1e-5)


def test_images_behind_mirrors_are_those_of_the_vortices() -> None:
    """A quarter of a wake between two mirrors."""
    place = Place(ROOM, 1, False), Place(ROOM, 2, False)
    random = np.random.default_rng(3)
    places, vorticity = random.uniform(0.1, 1.0, (5, 3)), random.normal(size=(5, 3))
    all_places, all_vorticity = places, vorticity
    for mirror in place:
        turn = np.ones(3)
        turn[mirror.axis] = -1.0
        all_places = np.concatenate([all_places, all_places * turn])
        all_vorticity = np.concatenate([all_vorticity, -all_vorticity * turn])
    found = images(place, ROOM) * binned(np.zeros(3), places, vorticity)
    np.testing.assert_allclose(found, binned(np.zeros(3), all_places, all_vorticity), atol=1e-13)


def test_what_a_wake_lacks_is_the_source_at_its_end() -> None:
    """A wake that is slower by 0.2 m/s on 3 x 3 faces of 0.25 m^2 lacks 0.45 m^3/s."""
    velocity = ROOM.zeros_faces()
    velocity[0][:] = 1.0
    velocity[0][:, 1:4, 2:5] = 0.8
    circulation = circulations(velocity, ROOM)
    line = wake_line(sea(1.0, 0.0, 0.0))
    rate, speed = leaving(circulation, velocity, Place(ROOM, 0, True), line)
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
    velocity = tuple(0.01 * random.normal(size=ROOM.face_shape(a)) for a in range(3))
    circulation = circulations(velocity, ROOM)
    stream = np.zeros(3)
    stream[axis] = 2.0 if upper else -2.0
    uniform = tuple(np.full(ROOM.face_shape(a), stream[a]) for a in range(3))
    rate, speed = leaving(circulation, uniform, Place(ROOM, axis, upper), wake_line(sea(*stream)))
    assert speed == pytest.approx(2.0)
    for i in range(3):
        at = (-1 if i == axis else -2) if upper else int(i != axis)
        assert rate[i] == pytest.approx(2.0 * circulation[i].take(at, axis).sum())
    assert np.abs(rate[3:]).max() > 0.0
    np.testing.assert_allclose(rate[3 + 3 * axis : 6 + 3 * axis], 0.0, atol=1e-14)


def test_beside_mirrors_the_line_is_on_both() -> None:
    wall = BoundaryClosed()
    found = Boundaries(FAR, FAR, wall, FAR, wall, FAR).sea(ROOM)
    assert found is not None
    np.testing.assert_allclose(wake_line(found).start, (3.0, -1.5, -1.5))


@pytest.mark.parametrize("way", [(8, 0, 0), (-8, 0, 0), (0, 5, -4), (-3, -2, 1)])
def test_the_wake_of_a_room_stays_in_the_world_when_the_domain_moves(
    way: tuple[int, int, int],
) -> None:
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
        return potential(wake_line(sea), wake[1], away, axis)

    here, wake = grid, bins
    for axis, cells in enumerate(way):
        for _ in range(abs(cells)):
            there = here.moved(axis, int(np.sign(cells)))
            wake = after_move(wake, grid.zeros_faces(), sides.sea(here), sides.sea(there))
            here = there
    for axis in range(3):
        assert induced(here, wake, axis) == pytest.approx(induced(grid, bins, axis), rel=5e-3)


def test_what_the_exit_of_a_room_leaves_behind_goes_into_the_wake() -> None:
    sides = Boundaries(*(FAR,) * 6)
    velocity = ROOM.zeros_faces()
    velocity[0][-2, 3, 4] = 1.0
    seas = sides.sea(ROOM), sides.sea(ROOM.moved(0, -1))
    wake = after_move(np.zeros((6, BINS, 12)), velocity, *seas)[1]
    np.testing.assert_allclose(wake[0, :3], 0.0, atol=1e-14)
    assert wake[0, 3:].reshape(3, 3)[1, 2] == pytest.approx(0.5**3)
    assert wake[0, 3:].reshape(3, 3)[2, 1] == pytest.approx(-(0.5**3))
    assert not wake[1:].any()
