"""Even rows: found as they are, and worked on to the same numbers."""

import numpy as np
import pytest

from flowborne.kernels.even import ROUNDING, find_even
from flowborne.kernels.smoothing import WEIGHTS, apply_laplacian, smooth

from .padded import cells_of
from .references.laplacian import operator

SHAPES = pytest.mark.parametrize("shape", [(6, 7, 12), (1, 9, 14)])
CLOSED, ROUND = (0, 0, 0), (0, 1, 1)


def weights_around(shape, periodic, hole, kind=np.float64):
    """Padded weights of a room of even cells with a hole, sides closed or periodic, and 1 / D."""
    padded = tuple(n + 2 * (n > 1) for n in shape)
    inside, weights = cells_of(np.empty(padded)), []
    open_cell = np.zeros(padded)
    open_cell[inside] = 1.0
    open_cell[hole] = 0.0
    for axis in range(3):
        if periodic[axis]:
            ends = np.moveaxis(open_cell, axis, 0)
            ends[0], ends[-1] = ends[-2], ends[1]
    for axis in range(3):
        w = np.zeros(padded, kind)
        if shape[axis] > 1:
            w[:] = (0.5 + axis) * open_cell * np.roll(open_cell, 1, axis)
        weights.append(w)
    diagonal = sum(w + np.roll(w, -1, axis) for axis, w in enumerate(weights))
    only = np.zeros(padded, kind)
    only[inside] = diagonal[inside]
    return tuple(weights), only


@SHAPES
@pytest.mark.parametrize("periodic", [CLOSED, ROUND])
def test_all_rows_are_even_but_those_that_the_hole_touches(shape, periodic):
    middle = (3 if shape[0] > 1 else 0, 4, 6)
    w, diagonal = weights_around(shape, periodic, middle)
    even = np.empty(diagonal.shape[:2], np.uint8)
    common = find_even(w, np.array(periodic, np.uint8), even, ROUNDING)
    assert [values.flat[common] for values in w] == [0.5 if shape[0] > 1 else 0.0, 1.5, 2.5]
    d = 1 if shape[0] > 1 else 0
    touched = {(middle[0], middle[1] + n) for n in (-1, 0, 1)}
    touched |= {(middle[0] + n, middle[1]) for n in (-d, d)}
    rows = np.argwhere(even[cells_of(diagonal)[:2]] == 0)
    assert {(m + d, j + 1) for m, j in rows} == touched


def test_without_a_cell_of_equal_weights_no_row_is_even():
    w, even = np.random.default_rng(0).random((3, 1, 7, 8)), np.ones((1, 7), np.uint8)
    assert find_even(tuple(w), np.zeros(3, np.uint8), even, ROUNDING) == 0
    assert not even.any()


@SHAPES
@pytest.mark.parametrize("periodic", [CLOSED, ROUND])
def test_even_rows_have_the_numbers_of_all_others(shape, periodic):
    w, diagonal = weights_around(shape, periodic, (1 if shape[0] > 1 else 0, 3, 5))
    even = np.empty(diagonal.shape[:2], np.uint8)
    common = find_even(w, np.array(periodic, np.uint8), even, ROUNDING)
    inverse = np.divide(1.0, diagonal, out=np.zeros_like(diagonal), where=diagonal > 0.0)
    random, inside = np.random.default_rng(0), cells_of(diagonal)
    x, b = np.zeros_like(diagonal), np.zeros_like(diagonal)
    x[inside], b[inside] = random.standard_normal((2, *shape))
    x *= diagonal > 0.0
    for axis in range(3):
        if periodic[axis]:
            ends = np.moveaxis(x, axis, 0)
            ends[0], ends[-1] = ends[-2], ends[1]
    for kernel, arguments, last in ((smooth, (x, b), (WEIGHTS[1],)), (smooth, (x, b), (None,))):
        found, expected = np.zeros_like(x), np.zeros_like(x)
        kernel(found, *arguments, (*w, inverse, even, common), *last)
        kernel(expected, *arguments, operator(w, inverse), *last)
        np.testing.assert_allclose(found, expected, rtol=1e-13, atol=1e-13)
    found, expected = np.zeros_like(x), np.zeros_like(x)
    energy = apply_laplacian(found, x, (*w, diagonal, even, common))
    assert energy == pytest.approx(apply_laplacian(expected, x, operator(w, diagonal)), rel=1e-13)
    np.testing.assert_allclose(found, expected, rtol=1e-13, atol=1e-13)
