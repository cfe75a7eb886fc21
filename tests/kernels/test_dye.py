"""Dye carried through the faces of whole and of cut cells, against NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.kernels.dye import (
    CUT,
    EMPTY,
    WHOLE,
    CutCells,
    list_flows,
    pass_on,
    sort_cells,
    sweep,
)

from .references.cut_dye import beside_reference, pass_on_reference, sort_cells_reference
from .references.dye import bend_reference, sweep_reference

SHAPES = [(3, 9, 5), (1, 12, 80), (2, 4, 3)]
ROOM = (5, 4, 6)
NEVER = -1e9, 1e9
"""Bounds that hold nothing."""

ORDERS = [(0, 1, 2), (2, 1, 0), (2, 0, 1), (1, 0, 2), (0, 2, 1)]
"""Of axes: those of a room and of a slab."""


def flows(shape: tuple[int, int, int], random: np.random.Generator) -> list[np.ndarray]:
    """Random fluxes of which no more leaves a cell than it holds in a step of 1."""
    sizes = [tuple(n + (axis == d) for d, n in enumerate(shape)) for axis in range(3)]
    return [random.uniform(-0.15, 0.15, size) for size in sizes]


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("wraps", [False, True])
@pytest.mark.parametrize("bounds", [NEVER, (0.2, 0.8)])
def test_sweep(
    order: tuple[int, int, int],
    shape: tuple[int, int, int],
    wraps: bool,
    bounds: tuple[float, float],
) -> None:
    """In a box of larger arrays, along each axis."""
    random = np.random.default_rng(1)
    flux = random.uniform(-0.5, 0.5, (shape[0], shape[1] + 1, shape[2]))
    if wraps:
        flux[:, -1] = flux[:, 0]
    field, volume = random.uniform(*np.clip(bounds, 0.0, 1.0), shape), random.uniform(1, 1.2, shape)
    ends = random.uniform(0.3, 0.7, (2, shape[0], shape[2]))
    clear = (random.random(shape) < 0.8).astype(np.uint8)
    expected = sweep_reference(field, volume, flux, clear, ends, wraps, 0.9, *bounds)
    arrays = field, volume, flux, clear
    around = [np.pad(a, 1).transpose(np.argsort(order)).copy() for a in arrays]
    x, y, z = (1 + shape[order.index(axis)] for axis in range(3))
    box = (1, 1, 1), (x, y, z), order
    crossed = sweep((around[0], around[1]), *around[2:], box, ends, wraps, 0.9, bounds)
    carried = [np.pad(a, 1).transpose(np.argsort(order)) for a in expected[:2]]
    for given, value in zip((*around[:2], crossed), (*carried, expected[2]), strict=True):
        np.testing.assert_allclose(given, value, atol=1e-14)
    assert len(sweep.outer.signatures) == 1, "compiled once for all axes"


@pytest.mark.parametrize("courant", [0.1, 0.5, 0.9, -0.4])
def test_means_of_a_parabola_are_carried_exactly(courant: float) -> None:
    """Where nothing limits it, what crosses a face is the mean of the parabola over what flows."""
    x = np.arange(13.0)
    whole = 2.0 * x + 3.0 * x**2 + 0.1 * x**3 / 3.0
    field = np.diff(whole).reshape(1, 12, 1)
    flux = np.full((1, 13, 1), courant)
    clear, ends = np.ones(field.shape, np.uint8), np.zeros((2, 1, 1))
    box = (0, 0, 0), (1, 12, 1), (0, 1, 2)
    sweep((field, np.ones(field.shape)), flux, clear, box, ends, False, 1.0, NEVER)
    moved = x[3:10] - courant
    exact = np.diff(2.0 * moved + 3.0 * moved**2 + 0.1 * moved**3 / 3.0)
    np.testing.assert_allclose(field[0, 3:9, 0], exact, rtol=1e-13)


def test_parabolas_stay_between_their_neighbours_but_for_smooth_extrema() -> None:
    rough = np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.2, 0.1, 0.9])
    low, high = bend_reference(rough, np.ones(6), 0.0, 1.0)
    assert not low[[0, 1, 2, 4]].any()
    assert not high[[0, 1, 2, 4]].any()
    smooth = 1.0 - 0.01 * (np.arange(9.0) - 4.2) ** 2
    low, high = bend_reference(smooth, np.ones(5), *NEVER)
    np.testing.assert_allclose(low + high, 0.5 * (smooth[3:-1] - smooth[1:-3]), atol=1e-14)
    low, high = bend_reference(smooth, np.ones(5), 0.0, smooth.max())
    assert low[2] == high[2] == 0.0


def sample() -> tuple[CutCells, np.ndarray, np.ndarray]:
    """A room that is periodic along x with some cut cells: its tables, its fluxes and volumes."""
    random = np.random.default_rng(4)
    fluxes = flows(ROOM, random)
    fluxes[0][-1] = fluxes[0][0]
    listed = np.flatnonzero(random.random(ROOM) < 0.3)
    wraps = ROOM[0], 0, 0
    unknown = np.full((2, listed.size, 6), -1)
    cells = CutCells(listed, *unknown, np.zeros((listed.size, 6)))
    kept = [flux.copy() for flux in fluxes]
    for axis in range(3):
        list_flows(cells, axis, fluxes[axis], wraps, ROOM)
    beside, row = beside_reference(listed, np.array(ROOM), np.array(wraps))
    np.testing.assert_array_equal(cells.beside, beside)
    np.testing.assert_array_equal(cells.row, row)
    gone = (np.diff(was - q, axis=a) for a, (was, q) in enumerate(zip(kept, fluxes, strict=True)))
    net = sum(gone, np.zeros(ROOM))
    return cells, net, np.array([np.count_nonzero(q) for q in fluxes])


def test_fluxes_of_cut_cells_are_listed_and_taken_out() -> None:
    """What leaves through all faces of a cut cell is what its fluxes were."""
    cells, net, left = sample()
    np.testing.assert_allclose(cells.out.sum(axis=1), net.ravel()[cells.listed], atol=1e-15)
    assert left.min() > 0


def test_pass_on() -> None:
    random = np.random.default_rng(5)
    cells, _, _ = sample()
    n = cells.listed.size
    field, volume = random.random(ROOM), np.ones(ROOM)
    volume.ravel()[cells.listed] = random.choice([0.0, 1e-6, 0.3, 0.7], n)
    gain = random.random(n) * (random.random(n) < 0.2)
    local = random.uniform(-0.1, 0.1, n) * (random.random(n) < 0.2)
    short = volume.ravel()[cells.listed] + gain + local - cells.out.sum(axis=1)
    volume.ravel()[cells.listed] -= np.minimum(short, 0.0)
    given = random.random((n, 6)), gain, gain * random.random(n), local
    expected = pass_on_reference(field, volume, *cells, *given)
    gained = pass_on(field, volume, cells, *given, NEVER)
    assert gained == pytest.approx(expected[2], abs=1e-13)
    np.testing.assert_allclose(volume, expected[1], atol=1e-14)
    filled = volume > 1e-9
    np.testing.assert_allclose(field[filled], expected[0][filled], atol=1e-12)
    assert 0.0 <= field.min() < field.max() <= 1.0


def test_sort_cells() -> None:
    random = np.random.default_rng(6)
    before, after = random.choice([0.0, 0.4, 0.995, 1.0], (2, *ROOM))
    rate = random.random(ROOM) * (random.random(ROOM) < 0.1)
    fluxes = [q * (random.random(q.shape) < 0.3) for q in flows(ROOM, random)]
    kind, fullest = sort_cells(before, after, rate, tuple(fluxes), 0.99)
    expected = sort_cells_reference(before, after, rate, *fluxes, 0.99)
    np.testing.assert_array_equal(kind, expected[0])
    np.testing.assert_allclose(fullest, expected[1], atol=1e-15)
    assert {WHOLE, CUT, EMPTY} == set(kind.ravel().tolist())
