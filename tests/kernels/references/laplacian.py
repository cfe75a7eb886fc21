"""The kernels for the Laplacian in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Operator, Real, Triple

from ..padded import cells_of


def operator(w: Triple, diagonal: Real) -> Operator:
    """K of weights of which each may be another one; `diagonal` or its inverse."""
    return w[0], w[1], w[2], diagonal, np.zeros(diagonal.shape[:2], np.uint8), 0


def apply_laplacian_reference(p: Array, K: Operator) -> Array:
    """`apply_laplacian` in NumPy, K p with ghosts 0."""
    *w, diagonal, _, _ = K
    out = np.zeros_like(p)
    inside = cells_of(p)
    out[inside] = (diagonal * p - neighbour_sum(p, (w[0], w[1], w[2])))[inside]
    return out


def neighbour_sum(x: Real, w: Triple) -> Array:
    """Sum over the faces of every cell of w x_neighbour; right in cells, not in ghosts."""
    total = np.zeros(x.shape)
    for axis in range(3):
        if x.shape[axis] > 1:
            total += w[axis] * np.roll(x, 1, axis)
            total += np.roll(w[axis], -1, axis) * np.roll(x, -1, axis)
    return total
