"""What a coarse level is made of, and the regions of the finest, against NumPy."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from flowborne.kernels.levels import (
    N0,
    S0,
    at_level,
    coarse_sums,
    coarse_weights,
    columns_to_diagonal,
    distance_ratio,
    finest_weights,
    has_any,
    interpolation_weights,
    inverse_diagonal,
    orphans_at,
    weights_at,
)
from flowborne.kernels.regions import label_regions, region_loads, region_sums, remove_null

from .padded import cells_of
from .references.centres import distance_ratio_reference, interpolation_weights_reference
from .references.levels import (
    coarse_sums_reference,
    coarse_weights_reference,
    columns_to_diagonal_reference,
    finest_weights_reference,
    inverse_diagonal_reference,
)
from .references.regions import (
    label_regions_reference,
    region_loads_reference,
    remove_null_reference,
)
from .test_multigrid import SHAPES, system_of

LENGTHS = list(itertools.product((5, 8, 13, 16), (1, 2, 4), (1, 2), (False, True)))
"""Finest cells, how many of them in a fine cell, factor of coarsening, whether periodic."""


@pytest.mark.parametrize(("cells", "size", "factor", "periodic"), LENGTHS)
def test_distances_between_centres(cells: int, size: int, factor: int, periodic: bool) -> None:
    coarse = -(-cells // (size * factor))
    for face in range(coarse + 1):
        given = face, factor, size, cells, periodic
        assert distance_ratio(*given) == pytest.approx(distance_ratio_reference(*given)), face
    n = -(-cells // size)
    interpolation = np.empty(n + 2, np.float32)
    interpolation_weights(interpolation, n, factor, size, cells, periodic)
    np.testing.assert_allclose(
        interpolation, interpolation_weights_reference(n, factor, size, cells, periodic), atol=1e-7
    )


@pytest.mark.parametrize("shape", [(6, 7, 10), (1, 12, 9)])
def test_finest_weights(shape: tuple[int, int, int]) -> None:
    random = np.random.default_rng(0)
    faces = [
        random.random(tuple(n + (d == axis) for d, n in enumerate(shape))) for axis in range(3)
    ]
    if shape[0] == 1:
        faces[0] = np.zeros((1, 1, 1))
    padded = tuple(n + 2 if n > 1 else 1 for n in shape)
    *w, diagonal = (np.zeros(padded) for _ in range(4))
    finest_weights(tuple(faces), tuple(w), diagonal)
    for one, other in zip((*w, diagonal), finest_weights_reference(tuple(faces)), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-15)


@pytest.mark.parametrize(("shape", "periodic"), SHAPES)
def test_coarse_operator(shape: tuple, periodic: tuple) -> None:
    """Weights without those of orphans, the diagonal, and what is added to it."""
    b, random = system_of(shape, periodic).buffers, np.random.default_rng(1)
    table, marks = b.table, at_level(b.marks, b.table, 0)
    w, inverse = weights_at(b.weights, table, 0), at_level(b.inverse, table, 0)
    added = random.random(inverse.shape).astype(np.float32)
    out = np.empty_like(inverse)
    inverse_diagonal(w, added, out)
    np.testing.assert_allclose(out, inverse_diagonal_reference(w, added), rtol=1e-5)
    factor = table[1, S0 : S0 + 3] // table[0, S0 : S0 + 3]
    for axis in range(3):
        wide = np.empty_like(at_level(b.weights[axis], table, 1))
        ratio = random.random(table[1, N0 + axis] + 1)
        coarse_weights(w[axis], wide, marks, axis, factor, ratio)
        if wide.shape[axis] > 1:
            inside = list(cells_of(wide))
            inside[axis] = slice(1, None)
            expected = coarse_weights_reference(w[axis], marks, axis, factor, ratio)
            np.testing.assert_allclose(wide[tuple(inside)], expected, rtol=1e-5, atol=1e-7)
            wide[tuple(inside)] = 0.0
        assert not wide.any()
    orphans, aggregates = orphans_at(b.orphans, table, 0), at_level(b.aggregates, table, 0)
    sums = np.empty_like(at_level(b.inverse, table, 1))
    coarse_sums(added, sums, marks, factor, orphans, aggregates)
    expected = coarse_sums_reference(
        added, marks, factor, orphans, aggregates, np.array(sums.shape)
    )
    np.testing.assert_allclose(sums, expected, rtol=1e-5)


@pytest.mark.parametrize(("shape", "periodic"), SHAPES)
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_regions(shape: tuple, periodic: tuple, seed: int) -> None:
    system = system_of(shape, periodic, seed)
    b, random = system.buffers, np.random.default_rng(seed)
    for w in b.finest[:3]:  # more faces shut, the same on both sides of periodic axes
        w[random.random(w.shape) < 0.4] = 0.0
        for axis in range(3):
            ends = np.moveaxis(w, axis, 0)
            if system.buffers.periodic[axis] and w is b.finest[axis]:
                ends[-1] = ends[1]
    label, parent = np.empty_like(b.label), np.empty_like(b.parent)
    count = np.zeros_like(b.count)
    regions = label_regions(
        b.finest, system.finest[4], system.buffers.periodic, label, parent, count
    )
    expected = label_regions_reference(b.finest, system.buffers.periodic)
    assert regions == expected.max() + 1 > 1
    np.testing.assert_array_equal(label, expected)
    np.testing.assert_array_equal(count[:regions], np.bincount(label[label >= 0]))
    x, size = random.standard_normal(label.shape), 6
    sums = np.bincount(label[label >= 0], x[label >= 0])
    np.testing.assert_allclose(region_sums(x, label, regions), sums, atol=1e-12)
    basis = np.linalg.qr(random.standard_normal((regions, 2)))[0]
    cleared = remove_null_reference(x, label, basis)
    remove_null(x, label, basis)
    np.testing.assert_allclose(x, cleared, atol=1e-12)
    start = np.append(0, np.cumsum(random.integers(0, 4, 40)))
    cells = random.integers(0, label.size, 40)
    rows = cells, start, random.integers(0, size, start[-1]), random.standard_normal(start[-1])
    expected = region_loads_reference(label, regions, size, rows)
    np.testing.assert_allclose(region_loads(label, regions, size, rows), expected, atol=1e-13)


@pytest.mark.parametrize("shape", [(5, 3, 6), (1, 4, 5), (3, 3, 3)])
@pytest.mark.parametrize("periodic", [(0, 0, 0), (1, 0, 1)])
def test_weak_columns_go_to_the_diagonal(
    shape: tuple[int, int, int], periodic: tuple[int, int, int]
) -> None:
    random = np.random.default_rng(0)
    weights = [random.random(shape, np.float32) for _ in range(3)]
    added = random.random(shape, np.float32)
    expected, sums = [w.copy() for w in weights], added.copy()
    ring = np.array(periodic, np.uint8)
    columns_to_diagonal_reference(tuple(expected), sums, ring)
    columns_to_diagonal(tuple(weights), added, ring)
    np.testing.assert_array_equal(added, sums)
    np.testing.assert_array_equal(weights, expected)
    assert has_any(added)
    assert not has_any(0.0 * added)
