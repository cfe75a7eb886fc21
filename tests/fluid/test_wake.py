"""The wake beyond the exit: bins of circulation and moment on a line."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.grid import Array, Grid
from flowborne.fluid.induced import after_move
from flowborne.fluid.sea import Sea
from flowborne.fluid.sea_slab import across, leaving, node_circulation, nodes_of, stream_function
from flowborne.fluid.sides.far import BoundaryFar
from flowborne.fluid.sides.kinds import BoundaryClosed
from flowborne.fluid.sides.side import Place
from flowborne.fluid.wake import BIN, BINS, moved, resampled, wake_line, with_all_circulation_0

GRID = Grid.slab(12, 8, 0.5, (-1.0, 2.0))


def sea(*velocity: float) -> Sea:
    found = Boundaries(*(BoundaryFar((*velocity, 0.0)),) * 4).sea(GRID)
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
    bins, nodes = np.zeros((BINS, 2)), nodes_of(Place(GRID, 1, False))
    offsets, vortices = np.array([0.4, -0.2]), np.array([1.0, -0.7])
    bins[40] = vortices.sum(), vortices @ offsets
    places = line.middles[40] + offsets[:, None] * across(line)
    away = np.linalg.norm(nodes[:, None] - places, axis=2)
    expected = -np.log(away) @ vortices / (2.0 * np.pi)
    found = stream_function(line, bins, nodes)
    np.testing.assert_allclose(np.diff(found), np.diff(expected), rtol=1e-4)


def test_the_last_bin_goes_on_for_ever() -> None:
    """As a source whose flux is that of twice as many bins, and one behind those."""
    line, nodes = wake_line(sea(1.0, 0.0)), nodes_of(Place(GRID, 1, True))
    bins = np.zeros((BINS, 2))
    bins[:, 1] = 0.3
    found = np.diff(stream_function(line, bins, nodes))
    many = line.start + np.multiply.outer(line.length * (np.arange(100 * BINS) + 0.5), line.along)
    away = nodes[:, None] - many
    square = (away**2).sum(axis=2)
    expected = np.diff((0.3 * (away @ across(line)) / square).sum(axis=1) / (2.0 * np.pi))
    np.testing.assert_allclose(found, expected, rtol=0.02)


def test_what_leaves_goes_on_and_is_kept() -> None:
    """Circulation and moment of a column of vortices next to the exit that moves with the flow."""
    velocity = GRID.zeros_faces()
    velocity[0][:] = 2.0
    velocity[1][-1:, 3] = 0.25
    circulation, place = node_circulation(velocity, GRID), Place(GRID, 0, True)
    line = wake_line(sea(1.0, 0.0))
    rate, speed = leaving(circulation, velocity, place, line)
    total = circulation[-2].sum()
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
            before, after = sides.sea(here), sides.sea(there)
            assert before is not None
            assert after is not None
            wake, here = after_move(wake, still, before, after), there
    assert induced(here, wake) == pytest.approx(induced(grid, bins), rel=2e-3)


def test_what_the_exit_leaves_behind_goes_into_the_wake() -> None:
    sides = Boundaries(*(BoundaryFar(velocity=(2.0, 0.0, 0.0)),) * 4)
    grid = Grid.slab(16, 16, 0.1, (0.0, 0.0))
    velocity = grid.zeros_faces()
    velocity[0][-2, 9] = 1.0
    seas = sides.sea(grid), sides.sea(grid.moved(0, -1))
    assert seas[0] is not None
    assert seas[1] is not None
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
