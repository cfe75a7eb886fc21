"""Volumes that control volumes give to each other: sums stay, and excesses even out."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne import Grid
from flowborne.fluid.control_volumes import ControlVolumes, control_volumes
from flowborne.kernels.control_volumes import Transfers
from flowborne.kernels.face_masses import Openings, add_transfers, even_out
from flowborne.kernels.flux import Stage
from flowborne.worlds import Boundaries, cut_by_bodies, make_world
from flowborne_validation.worlds import RING, mjcf

from .references.faces import face_means

BODIES = {
    "disc": '<body pos="0.51 0.47 {z}"><freejoint/><geom type="sphere" size="0.21"/></body>',
    "thin": '<body pos="0.5 0.5 {z}" euler="0 0 0.3"><freejoint/>'
    '<geom type="box" size="0.3 0.02 0.2"/></body>',
}
GRIDS = {
    "slab": Grid.slab(24, 24, 1 / 24, (0.0, 0.0)),
    "room": Grid((16, 16, 16), 1 / 16, (0.0, 0.0, 0.0)),
}


def volumes_at(body: str, grid: Grid, sides: Boundaries) -> tuple[ControlVolumes, list[np.ndarray]]:
    world = make_world(
        mjcf(BODIES[body].format(z=0.0 if grid.is_slab else 0.5)), grid, boundaries=sides
    )
    cut = cut_by_bodies(world)
    return control_volumes(cut.volume, cut.open, grid, sides), list(cut.open)


@pytest.mark.parametrize("sides", [Boundaries(), RING], ids=["closed", "ring"])
@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("name", GRIDS)
def test_what_moves_with_faces_is_near_their_opening_and_all_there_is(
    name: str, body: str, sides: Boundaries
) -> None:
    """Transfers lead from control volumes to what moves; closed faces keep nothing."""
    grid = GRIDS[name]
    found, opened = volumes_at(body, grid, sides)
    for axis in grid.axes:
        volume = face_means(found.cells, axis, sides.periodic()[axis])
        moving, given = found.moving[axis], found.transfers[axis]
        reached = volume.ravel().copy()
        np.subtract.at(reached, given.givers, given.volume)
        np.add.at(reached, given.takers, given.volume)
        own = np.ones(volume.shape, bool)
        if sides.periodic()[axis]:
            np.moveaxis(own, axis, 0)[-1] = False
        once = own.ravel()
        np.testing.assert_allclose(reached[once], moving.ravel()[once], atol=1e-15)
        assert (moving[own & (opened[axis] == 0.0)] == 0.0).all()
        assert (moving[own & (opened[axis] > 1e-9)] > 0.0).all()
        ends = np.zeros(volume.shape, bool)
        np.moveaxis(ends, axis, 0)[[0, -1]] = True
        goal = grid.cell_volume * opened[axis]
        cut = own & ~ends & (volume != goal) & (goal > 0.0)
        before, after = (np.abs(v - goal)[cut].mean() for v in (volume, moving))
        assert after < 0.5 * before


def test_in_a_ring_of_equal_openings_each_gets_the_mean_excess_of_both_beside_it() -> None:
    held, whole = np.array([1.3, 1.0, 1.1]), np.ones(3)
    given, gained = np.zeros(3), np.zeros(3)
    between = Openings(np.array([1, 2, 0]), whole, np.zeros(3))
    even_out(held, whole, whole, between, 1.0, given, gained)
    np.testing.assert_allclose(held + gained, [1.05, 1.2, 1.15])
    np.testing.assert_allclose(given, [0.15, -0.05, -0.1], atol=1e-15)


def test_what_is_even_for_each_part_of_its_opening_stays() -> None:
    held, goal = np.array([0.22, 0.77, 0.11]), np.array([0.2, 0.7, 0.1])
    gained = np.zeros(3)
    between = Openings(np.array([1, 2, -1]), np.array([0.3, 0.5, 0.0]), np.zeros(3))
    even_out(held, goal, goal, between, 1.0, np.zeros(3), gained)
    np.testing.assert_allclose(gained, 0.0, atol=1e-15)


def test_one_keeps_half_of_what_its_opening_says() -> None:
    """Beside a wide one that lacks as much as there is."""
    held, goal, opened = np.array([0.3, 0.1]), np.array([0.2, 1.0]), np.array([0.2, 1.0])
    gained = np.zeros(2)
    between = Openings(np.array([1, -1]), np.array([1.0, 0.0]), np.zeros(2))
    even_out(held, goal, opened, between, 1.0, np.zeros(2), gained)
    assert held[0] + gained[0] == pytest.approx(0.1)


def test_transfers_change_no_energy() -> None:
    """What one gives another, with the mean velocity of both."""
    random = np.random.default_rng(0)
    velocity, rate = random.standard_normal(9), random.standard_normal(20)
    givers, takers = random.integers(0, 9, (2, 20))
    kept, later, given = np.zeros(9), np.zeros(9), Transfers(givers, takers, rate)
    add_transfers(Stage(later, kept, np.full(9, 2.0), 0.5, 0.6, 0.0), velocity, given)
    np.testing.assert_allclose(later, 0.5 * kept, atol=1e-15)
    leaving = kept / -0.3
    volume = np.zeros(9)
    np.add.at(volume, givers, rate)
    np.subtract.at(volume, takers, rate)
    assert leaving.sum() == pytest.approx(0.0, abs=1e-14)
    change = velocity @ leaving - 0.5 * (velocity**2) @ volume
    assert change == pytest.approx(0.0, abs=1e-13)
