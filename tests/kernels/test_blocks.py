"""Operations that go through blocks of planes together, against one after the other."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from flowborne.kernels.smoothing import (
    BLOCK,
    STEPS,
    WEIGHTS,
    apply_laplacian,
    first_smooth,
    smooth,
    smooth_down,
    smooth_often,
    smooth_up,
    turn_and_apply,
)
from flowborne.kernels.vectors import descend, dot

from .padded import cells_of
from .references.laplacian import operator

SHAPES = pytest.mark.parametrize(
    "shape", [(3 * BLOCK + 7, 6, 9), (2 * BLOCK, 5, 4), (4, 5, 6), (1, 9, 8)]
)
THREADS = pytest.mark.parametrize("threads", ["serial", "parallel"])


def version(kernel: Any, threads: str) -> Any:
    """A kernel as Python calls it on one thread, or on several."""
    return (kernel if threads == "serial" else kernel.parallel).outer


def system(shape: tuple[int, int, int], kind: type) -> tuple[tuple, np.ndarray, list[np.ndarray]]:
    """Padded weights, their sum in every cell, and three fields; ghosts 0."""
    random = np.random.default_rng(0)
    padded = tuple(n + 2 * (n > 1) for n in shape)
    weights, inside = [], cells_of(np.empty(padded))
    for axis in range(3):
        w = np.zeros(padded, kind)
        if shape[axis] > 1:
            w[inside] = random.random(shape)
            np.moveaxis(w, axis, 0)[1] = 0.0
        weights.append(w)
    diagonal = np.zeros(padded, kind)
    for axis, w in enumerate(weights):
        diagonal += w + np.roll(w, -1, axis)
    fields = [np.zeros(padded, kind) for _ in range(3)]
    for values in fields:
        values[inside] = random.standard_normal(shape)
    return tuple(weights), diagonal, fields


@SHAPES
@THREADS
def test_smoothing_on_the_way_down_and_up(shape: tuple[int, int, int], threads: str) -> None:
    w, diagonal, (x, b, r) = system(shape, np.float32)
    inverse = np.divide(1.0, diagonal, out=np.zeros_like(diagonal), where=diagonal > 0.0)
    expected, left = x.copy(), r.copy()
    first_smooth(expected, b, inverse)
    K = operator(w, inverse)
    smooth(left, expected, b, K, WEIGHTS[1])
    smooth(expected, left, b, K, WEIGHTS[2])
    smooth(left, expected, b, K, None)
    version(smooth_down, threads)(x, r, b, K)
    np.testing.assert_array_equal(x, expected)
    np.testing.assert_array_equal(r, left)
    smooth(expected, left, b, K, WEIGHTS[2])
    smooth(left, expected, b, K, WEIGHTS[1])
    smooth(expected, left, b, K, WEIGHTS[0])
    version(smooth_up, threads)(x, r, b, K)
    np.testing.assert_array_equal(x, expected)


@pytest.mark.parametrize("shape", [(4, 2, 3), (1, 3, 4)])
@pytest.mark.parametrize("even", [0, 1])
def test_many_steps_on_the_coarsest_level(shape: tuple[int, int, int], even: int) -> None:
    w, diagonal, (x, b, r) = system(shape, np.float32)
    inverse = np.divide(1.0, diagonal, out=np.zeros_like(diagonal), where=diagonal > 0.0)
    K = operator(w, inverse)
    K[4][...] = even
    expected, left = x.copy(), r.copy()
    for step in range(1, 9):
        smooth(left, expected, b, K, WEIGHTS[step % STEPS])
        expected, left = left, expected
    smooth_often(x, r, b, K, 9)
    np.testing.assert_array_equal(x, expected)


@SHAPES
@THREADS
def test_turn_and_apply(shape: tuple[int, int, int], threads: str) -> None:
    w, diagonal, (p, z, _) = system(shape, np.float64)
    turned, out = 0.3 * z + 0.7 * p, np.zeros_like(p)
    energy = apply_laplacian(out, turned, operator(w, diagonal))
    assert version(turn_and_apply, threads)(z, p, z, 0.3, 0.7, operator(w, diagonal)) == energy
    np.testing.assert_array_equal(p, turned)
    np.testing.assert_array_equal(z, out)


@SHAPES
@THREADS
def test_descend_and_scale(shape: tuple[int, int, int], threads: str) -> None:
    _, x, (r, p, q) = system(shape, np.float64)
    b, one, other = np.zeros(x.shape, np.float32), x.copy(), r.copy()
    square = descend(one, other, p, q, 0.3)
    assert version(descend, threads)(x, r, p, q, 0.3, b, 2.0) == square
    for found, expected in ((x, one), (r, other), (b, (2.0 * other).astype(np.float32))):
        np.testing.assert_array_equal(found, expected)
    assert version(dot, threads)(p, r, 0.5) == pytest.approx(0.5 * dot(p, r), rel=1e-12)
