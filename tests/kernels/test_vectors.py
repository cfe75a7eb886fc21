"""Steps and sums of padded vectors against NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.kernels.vectors import (
    cells_of,
    descend,
    dot,
    largest,
    load_cells,
    scaled,
    scaled_cells,
    true_residual,
    turn,
)

SHAPES = [(6, 7, 8), (1, 9, 7)]


def fields(shape: tuple[int, int, int], count: int) -> np.ndarray:
    return np.random.default_rng(0).standard_normal((count, *shape))


@pytest.mark.parametrize("shape", SHAPES)
def test_sums_and_steps(shape: tuple[int, int, int]) -> None:
    x, r, p, q = fields(shape, 4)
    assert dot(x, r) == pytest.approx(np.vdot(x, r))
    assert largest(x) == x.max()
    assert largest(-np.abs(x)) == 0.0
    after = x + 0.3 * p, r - 0.3 * q, q + 0.7 * p
    assert descend(x, r, p, q, 0.3) == pytest.approx(np.vdot(after[1], after[1]))
    turn(p, q, 0.7)
    for found, expected in zip((x, r, p), after, strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-15)
    assert true_residual(r, x, q) == pytest.approx(np.square(x - q).sum())
    np.testing.assert_array_equal(r, x - q)


@pytest.mark.parametrize("shape", SHAPES)
def test_copies(shape: tuple[int, int, int]) -> None:
    source, left = fields(shape, 2)
    target = np.empty(shape, np.float32)
    scaled(source, target, 0.3)
    np.testing.assert_array_equal(target, (0.3 * source).astype(np.float32))
    expected, inside = left.copy(), cells_of(left)
    expected[inside] = 0.3 * source[inside]
    scaled_cells(source, left, 0.3)
    np.testing.assert_array_equal(left, expected)
    diagonal = np.maximum(source, 0.0)
    expected = np.zeros(shape)
    expected[inside] = np.where(diagonal[inside] > 0.0, left[inside], 0.0)
    load_cells(target := np.ones(shape), np.ascontiguousarray(left[inside]), diagonal)
    np.testing.assert_array_equal(target, expected)
