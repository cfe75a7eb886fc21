"""Red-black Gauss-Seidel on one level, and its residual.

Rows are worked on whole and without branches, so that the compiler makes vector code of them.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from flowborne.kernels.arrays import Array, Real, Triple
from flowborne.kernels.jit import kernel
from flowborne.kernels.laplacian import neighbour_sum
from flowborne.kernels.vectors import cells_of


@kernel
def smooth(x: Real, b: Real, w: Triple, inverse: Real, colour: int) -> None:
    """Gauss-Seidel on the cells of one colour of the chequerboard (0: first cell's; 1: others)."""
    w0, w1, w2 = w
    d = 1 if x.shape[0] > 1 else 0
    n2 = x.shape[2] - 2
    for i in prange(x.shape[0] - 2 * d):
        m = i + d
        row = np.empty(n2 + 2, x.dtype)
        for j in range(1, x.shape[1] - 1):
            parity = (i + j + colour) & 1
            for k in range(1, n2 + 1):
                total = b[m, j, k] + w1[m, j, k] * x[m, j - 1, k]
                total += w1[m, j + 1, k] * x[m, j + 1, k]
                total += w2[m, j, k] * x[m, j, k - 1] + w2[m, j, k + 1] * x[m, j, k + 1]
                if d:
                    total += w0[m, j, k] * x[m - 1, j, k] + w0[m + 1, j, k] * x[m + 1, j, k]
                row[k] = total * inverse[m, j, k] if (k & 1) == parity else x[m, j, k]
            for k in range(1, n2 + 1):
                x[m, j, k] = row[k]


def smooth_reference(x: Real, b: Real, w: Triple, inverse: Real, colour: int) -> Array:
    """`smooth` in NumPy: x after it."""
    i, j, k = np.indices(x.shape)
    chosen = (i - (x.shape[0] > 1) + j + k) % 2 == colour
    inside = cells_of(x)
    out = np.array(x, np.float64)
    out[inside] = np.where(chosen, (b + neighbour_sum(x, w)) * inverse, x)[inside]
    return out


@kernel
def first_smooth(x: Real, b: Real, inverse: Real) -> None:
    """Red sweep from x = 0: red cells b * inverse, all else and the ghosts 0."""
    d = 1 if x.shape[0] > 1 else 0
    for i in prange(x.shape[0]):
        for j in range(x.shape[1]):
            for k in range(x.shape[2]):
                red = ((i - d + j + k) & 1) == 0
                x[i, j, k] = b[i, j, k] * inverse[i, j, k] if red else 0.0


@kernel
def defect(r: Real, x: Real, b: Real, w: Triple, inverse: Real) -> None:
    """r = b - K x in active cells, else 0; ghosts of r are left alone."""
    w0, w1, w2 = w
    d = 1 if x.shape[0] > 1 else 0
    for i in prange(x.shape[0] - 2 * d):
        m = i + d
        for j in range(1, x.shape[1] - 1):
            for k in range(1, x.shape[2] - 1):
                total = b[m, j, k] + w1[m, j, k] * x[m, j - 1, k]
                total += w1[m, j + 1, k] * x[m, j + 1, k]
                total += w2[m, j, k] * x[m, j, k - 1] + w2[m, j, k + 1] * x[m, j, k + 1]
                if d:
                    total += w0[m, j, k] * x[m - 1, j, k] + w0[m + 1, j, k] * x[m + 1, j, k]
                a = inverse[m, j, k]
                r[m, j, k] = total - x[m, j, k] / a if a > 0.0 else 0.0


def defect_reference(x: Real, b: Real, w: Triple, inverse: Real) -> Array:
    """`defect` in NumPy, with ghosts 0."""
    r, inside = np.zeros(x.shape), cells_of(x)
    active = inverse > 0.0
    K_x = x / np.where(active, inverse, 1.0) - neighbour_sum(x, w)
    r[inside] = np.where(active, b - K_x, 0.0)[inside]
    return r
