"""Guests, small and empty control volumes against NumPy; what they exchange adds up."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
import pytest

from flowborne.kernels.arrays import FREE, PERIODIC, PRESCRIBED, FaceGrid
from flowborne.kernels.control_volumes import (
    DRIVEN,
    Closed,
    fill_empty,
    find_targets,
    join_small,
    level,
    listed_kinds,
    mark_cut,
    merge_small,
    neighbour,
    share_velocity,
    sort_faces,
)
from flowborne.kernels.lists import merged

from .cut_cells import face_shape
from .references.control_volumes import (
    fill_empty_reference,
    find_closed_reference,
    find_parts_reference,
    find_targets_reference,
    join_small_reference,
    level_reference,
    mark_cut_reference,
    merge_small_reference,
    neighbours_reference,
    share_velocity_reference,
)

CASES = [
    (shape, periodic, component)
    for shape, periodic in product(
        [(7, 6, 5), (9, 8, 1)], [(False, False, False), (True, True, False), (False, True, True)]
    )
    for component in range(3 if shape[2] > 1 else 2)
    if shape[2] > 1 or not periodic[2]
]
ROOM_OR_SLAB = pytest.mark.parametrize(("shape", "periodic", "component"), CASES)


@dataclass
class Case:
    """Random control volumes of one component, many of them small, closed or empty."""

    cells: np.ndarray
    opened: np.ndarray
    volumes: np.ndarray
    small: np.ndarray
    wraps: np.ndarray
    last: tuple[slice, ...] | None
    component: int

    @property
    def shape(self) -> np.ndarray:
        return np.array(self.volumes.shape)

    @property
    def faces(self) -> FaceGrid:
        return FaceGrid(self.component, self.shape, self.wraps)

    @property
    def pushed(self) -> np.ndarray:
        return (self.opened > 0.0).astype(np.uint8)

    def listed(self, below: float) -> np.ndarray:
        """Those smaller than this; none of the faces that stand twice."""
        small = self.volumes < below
        if self.last is not None:
            small[self.last] = False
        return np.flatnonzero(small)


def case_of(shape: tuple, periodic: tuple, component: int, seed: int = 0) -> Case:
    random = np.random.default_rng(seed)
    cells = random.random(shape) ** 2 * (random.random(shape) > 0.4)
    ends = [(int(axis == component),) * 2 for axis in range(3)]
    wide = np.pad(cells, ends, mode="wrap" if periodic[component] else "constant")
    low, high = ([slice(None)] * 3 for _ in range(2))
    low[component], high[component] = slice(None, -1), slice(1, None)
    volumes = 0.5 * (wide[tuple(low)] + wide[tuple(high)])
    size = face_shape(shape, component)
    opened = random.random(size) * (random.random(size) > 0.6)
    ends_open, last = np.moveaxis(opened, component, 0), None
    if periodic[component]:
        ends_open[-1] = ends_open[0]
        last = tuple(slice(-1, None) if a == component else slice(None) for a in range(3))
    else:
        ends_open[0] = -1.0
    closed = (opened == 0.0) & (volumes > 0.0)
    if last is not None:
        closed[last] = False
    wraps = np.array(shape) * np.array(periodic)
    return Case(cells, opened, volumes, np.flatnonzero(closed), wraps, last, component)


def targets_of(case: Case) -> Closed:
    return find_targets(
        case.small, case.pushed, case.opened, case.volumes, case.cells, case.faces, 1e-9
    )


def of_all(closed: Closed, size: int) -> np.ndarray:
    """Share of each control volume (n, size) in each closed one, in ascending order of these."""
    shares, order = np.zeros((closed.faces.size, size)), np.argsort(closed.faces)
    np.add.at(shares, (np.argsort(order)[:, None], closed.targets), closed.shares)
    return shares


@ROOM_OR_SLAB
def test_neighbours(shape: tuple, periodic: tuple, component: int) -> None:
    case = case_of(shape, periodic, component)
    expected = neighbours_reference(case.shape, case.wraps)
    for f, way in product(range(case.volumes.size), range(6)):
        assert neighbour(case.shape, case.wraps, f, way) == expected[way, f]


@pytest.mark.parametrize("sizes", [(40, 30), (0, 5), (5, 0), (0, 0)])
def test_merged(sizes: tuple[int, int]) -> None:
    random = np.random.default_rng(1)
    one, other = (np.sort(random.choice(60, size, replace=False)) for size in sizes)
    found, first, second = merged(one, other)
    np.testing.assert_array_equal(found, np.union1d(one, other))
    np.testing.assert_array_equal(found[first], one)
    np.testing.assert_array_equal(found[second], other)


@ROOM_OR_SLAB
def test_hosts(shape: tuple, periodic: tuple, component: int) -> None:
    """Found as said; a closed one that is a target comes later, so that in the end all is given."""
    for seed in range(20):
        case = case_of(shape, periodic, component, seed)
        closed = targets_of(case)
        expected = find_targets_reference(
            case.small,
            case.pushed,
            case.opened,
            case.volumes,
            case.cells,
            component,
            case.wraps,
            1e-9,
        )
        assert expected.any()
        np.testing.assert_array_equal(np.sort(closed.faces), case.small)
        np.testing.assert_allclose(of_all(closed, case.volumes.size), expected, rtol=1e-14)
        led = closed.shares.any(axis=1)
        np.testing.assert_allclose(closed.shares[led].sum(axis=1), 1.0, rtol=1e-15)
        given = np.ones(case.shape)
        merge_small(given, closed)
        np.testing.assert_allclose(given.ravel()[closed.faces[led]], 0.0, atol=1e-14)


def test_what_is_on_either_side_of_a_thin_body_stays_there() -> None:
    """Of two cells of 0.6 and 0.2, 0.9 and 0.7 open beyond, with a closed face between them."""
    cells = np.ones((4, 1, 1))
    cells[1], cells[2] = 0.6, 0.2
    opened = np.array([1.0, 0.9, 0.0, 0.7, 1.0]).reshape(5, 1, 1)
    volumes = np.array([0.5, 0.8, 0.4, 0.6, 0.5]).reshape(5, 1, 1)
    faces = FaceGrid(0, np.array(opened.shape), np.zeros(3, np.int64))
    pushed = (opened > 0.0).astype(np.uint8)
    closed = find_targets(np.array([2]), pushed, opened, volumes, cells, faces, 1e-9)
    np.testing.assert_allclose(of_all(closed, 5), [[0.0, 0.54 / 0.68, 0.0, 0.14 / 0.68, 0.0]])


def test_what_has_no_way_ahead_goes_with_all_that_is_beside_it() -> None:
    """A pocket of 0.6, closed beyond, is not joined through a body to a sliver of 0.2 behind it."""
    cells, opened, volumes = np.zeros((4, 3, 1)), np.zeros((5, 3, 1)), np.zeros((5, 3, 1))
    cells[:, 1, 0] = 0.0, 0.6, 0.2, 1.0
    opened[3, 1], opened[2, [0, 2]] = 0.7, 0.4
    volumes[3, 1], volumes[2, :, 0] = 0.6, (0.5, 0.4, 0.25)
    faces = FaceGrid(0, np.array(opened.shape), np.zeros(3, np.int64))
    pushed, small = (opened > 0.0).astype(np.uint8), np.array([2 * 3 + 1])
    closed = find_targets(small, pushed, opened, volumes, cells, faces, 1e-9)
    shares = of_all(closed, 15).reshape(5, 3)
    np.testing.assert_allclose(shares[2], np.array([0.4, 0.0, 0.2]) / 0.74)
    np.testing.assert_allclose(shares[3], [0.0, 0.14 / 0.74, 0.0])


def test_what_a_solve_left_is_no_way_ahead() -> None:
    """Cells that a body covers hold 1e-13 more or less than nothing."""
    cells, opened, volumes = np.zeros((4, 2, 1)), np.zeros((5, 2, 1)), np.zeros((5, 2, 1))
    cells[:, 0, 0] = 0.8, 1e-13, -1e-13, 0.8
    opened[[1, 3], 0], opened[2, 1] = 0.1, 1.0
    volumes[[1, 3], 0], volumes[2, 1] = 0.4, 1.0
    faces = FaceGrid(0, np.array(opened.shape), np.zeros(3, np.int64))
    pushed, small = (opened > 0.0).astype(np.uint8), np.array([2 * 2])
    closed = find_targets(small, pushed, opened, volumes, cells, faces, 1e-9)
    assert of_all(closed, 10)[0, 2 * 2 + 1] == 1.0


@ROOM_OR_SLAB
def test_small_ones_give_to_targets(shape: tuple, periodic: tuple, component: int) -> None:
    case = case_of(shape, periodic, component)
    closed = targets_of(case)
    amount = np.random.default_rng(1).standard_normal(case.volumes.shape)
    merged = amount.copy()
    part = np.random.default_rng(2).uniform(size=(closed.faces.size, 1))
    closed = closed._replace(shares=part * closed.shares)
    given = merge_small(merged, closed)
    expected = merge_small_reference(amount, *closed)
    np.testing.assert_allclose(merged, expected, atol=1e-14)
    assert merged.sum() == pytest.approx(amount.sum(), abs=1e-13 * np.abs(amount).sum())
    taken = amount.ravel().copy()
    np.add.at(taken, closed.targets, given)
    np.subtract.at(taken, closed.faces, given.sum(axis=1))
    np.testing.assert_allclose(taken, merged.ravel(), atol=1e-14)


@ROOM_OR_SLAB
def test_small_ones_bring_what_they_hold(shape: tuple, periodic: tuple, component: int) -> None:
    """Volumes of nothing hold an amount all the same, as one that closes in a step does."""
    case = case_of(shape, periodic, component)
    closed, volumes = targets_of(case), case.volumes.copy()
    volumes.reshape(-1)[closed.faces[::2]] = 0.0
    field = np.random.default_rng(1).standard_normal(volumes.shape)
    joined, merged = field.copy(), volumes.copy()
    part = np.random.default_rng(2).uniform(size=(closed.faces.size, 1))
    part[::2] = 1.0
    closed = closed._replace(shares=part * closed.shares)
    join_small(joined, merged, closed, 1e-9)
    expected, volumes_after = join_small_reference(field, volumes, *closed, 1e-9)
    np.testing.assert_allclose(merged, volumes_after, rtol=1e-12, atol=1e-14)
    own = np.ones(field.size, bool)
    own[case.small] = False
    np.testing.assert_allclose(joined.ravel()[own], expected.ravel()[own], rtol=1e-10)


@ROOM_OR_SLAB
def test_empty_ones_have_the_velocity_around_them(
    shape: tuple, periodic: tuple, component: int
) -> None:
    case = case_of(shape, periodic, component)
    field, listed = np.random.default_rng(2).standard_normal(case.volumes.shape), case.listed(0.3)
    filled = field.copy()
    fill_empty(filled, case.volumes, listed, 0.01, case.faces)
    expected = fill_empty_reference(field, case.volumes, listed, 0.01, case.wraps)
    assert (filled != field).any()
    np.testing.assert_allclose(filled, expected, atol=1e-14)
    kept = case.volumes > 0.01
    np.testing.assert_array_equal(filled[kept], field[kept])


@ROOM_OR_SLAB
def test_small_ones_mix_with_their_neighbours_and_keep_the_sum(
    shape: tuple, periodic: tuple, component: int
) -> None:
    case = case_of(shape, periodic, component)
    field, listed = np.random.default_rng(3).standard_normal(case.volumes.shape), case.listed(0.3)
    if case.last is not None:
        field[case.last] = np.take(field, [0], component)
    mixed, nothing = field.copy(), 0.01
    leaving = np.random.default_rng(4).uniform(0.0, 0.5, listed.size)
    nought = np.zeros(case.shape)
    level(mixed, case.volumes, listed, leaving, nought, nothing, case.faces)
    assert not nought.any()
    expected = level_reference(field, case.volumes, listed, leaving, nothing, case.wraps)
    assert (mixed != field).any()
    np.testing.assert_allclose(mixed, expected, atol=1e-14)
    weights = case.volumes.copy()
    if case.last is not None:
        weights[case.last] = 0.0
    before, after = (weights * field).sum(), (weights * mixed).sum()
    assert after == pytest.approx(before, abs=1e-13 * np.abs(weights * field).sum())
    assert mixed.min() >= field.min()
    assert mixed.max() <= field.max()
    assert (weights * mixed**2).sum() < (weights * field**2).sum()


@ROOM_OR_SLAB
def test_share_velocity(shape: tuple, periodic: tuple, component: int) -> None:
    case = case_of(shape, periodic, component)
    random = np.random.default_rng(7)
    small = np.sort(random.permutation(case.volumes.size)[:20])
    targets = random.integers(case.volumes.size, size=(20, 6))
    shares = random.random((20, 6)) / 6.0
    field = random.standard_normal(case.shape)
    expected = share_velocity_reference(field, small, targets, shares)
    share_velocity(field, Closed(small, targets, shares))
    np.testing.assert_allclose(field, expected, rtol=1e-14, atol=1e-15)


@ROOM_OR_SLAB
def test_mark_cut(shape: tuple, periodic: tuple, component: int) -> None:
    case = case_of(shape, periodic, component)
    depth = np.where(case.shape > 1, 2, 0)
    marks = np.ones(case.shape + 2 * depth, np.uint8)
    listed = case.listed(0.002)
    assert listed.size > 0
    expected = mark_cut_reference(marks, listed, case.shape, case.wraps)
    mark_cut(marks, listed, case.shape, case.wraps, 2)
    np.testing.assert_array_equal(marks, expected)


@ROOM_OR_SLAB
@pytest.mark.parametrize("told", [(0, 0), (1, 0), (1, 1)])
def test_sort_faces(shape: tuple, periodic: tuple, component: int, told: tuple) -> None:
    """Their volumes, and which are less than whole, closed, or have not what their opening says."""
    case, ring, cell, slack = case_of(shape, periodic, component), periodic[component], 0.5, 0.04
    prescribed = np.array((0, 0) if ring else told, np.uint8)
    shut, driven = find_closed_reference(
        case.opened, case.volumes, component, prescribed, ring, 0.01
    )
    goal = cell * case.opened
    if not ring:
        np.moveaxis(goal, component, 0)[[0, -1]] *= 0.5
    uneven = np.flatnonzero(driven & (np.abs(case.volumes - goal) > slack))
    part = find_parts_reference(case.volumes, 0.2 * cell, component, case.wraps)
    volumes, kinds = np.empty(case.shape), np.empty(case.shape, np.uint8)
    counts, limits = np.empty((np.prod(case.shape[:2]), 3), np.int64), (cell, 0.2, slack, 0.01)
    ends = np.full(2, PERIODIC) if ring else np.where(prescribed, PRESCRIBED, FREE)
    sort_faces(volumes, kinds, counts, case.cells, case.opened, component, ends, limits)
    np.testing.assert_array_equal(volumes, case.volumes)
    np.testing.assert_array_equal(kinds & DRIVEN, driven)
    for found, expected in zip(listed_kinds(kinds, counts), (part, shut, uneven), strict=True):
        np.testing.assert_array_equal(found, expected)
        assert 0 < found.size < case.volumes.size


def test_a_closed_face_whose_cells_cancel_passes_on_what_it_gets() -> None:
    """A body takes up both cells in a step, and rounding leaves them exactly opposite volumes."""
    cells, opened = np.zeros((6, 1, 1)), np.zeros((7, 1, 1))
    cells[2:4, 0, 0] = 1e-13, -1e-13
    volumes, kinds = np.empty((7, 1, 1)), np.empty((7, 1, 1), np.uint8)
    counts, limits = np.empty((7, 3), np.int64), (1.0, 0.2, 0.1, 1e-9)
    sort_faces(volumes, kinds, counts, cells, opened, 0, np.full(2, FREE), limits)
    assert volumes[3] == 0.0
    np.testing.assert_array_equal(listed_kinds(kinds, counts)[1], (2, 3, 4))
