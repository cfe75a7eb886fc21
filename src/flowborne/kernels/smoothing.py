"""Red-black Gauss-Seidel on one level, and its residual.

Rows are worked on whole and without branches, so that the compiler makes vector code of them.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from flowborne.kernels.arrays import Array, Real, Triple
from flowborne.kernels.blocks import BLOCK, reach
from flowborne.kernels.jit import inlined, kernel
from flowborne.kernels.laplacian import neighbour_sum
from flowborne.kernels.vectors import cells_of


@inlined
def smooth_plane(x: Real, b: Real, w: Triple, inverse: Real, colour: int, m: int) -> None:
    """`smooth` on plane m."""
    w0, w1, w2 = w
    d = 1 if x.shape[0] > 1 else 0
    n2 = x.shape[2] - 2
    row = np.empty(n2 + 2, x.dtype)
    for j in range(1, x.shape[1] - 1):
        parity = (m - d + j + colour) & 1
        for k in range(1, n2 + 1):
            total = b[m, j, k] + w1[m, j, k] * x[m, j - 1, k]
            total += w1[m, j + 1, k] * x[m, j + 1, k]
            total += w2[m, j, k] * x[m, j, k - 1] + w2[m, j, k + 1] * x[m, j, k + 1]
            if d:
                total += w0[m, j, k] * x[m - 1, j, k] + w0[m + 1, j, k] * x[m + 1, j, k]
            row[k] = total * inverse[m, j, k] if (k & 1) == parity else x[m, j, k]
        for k in range(1, n2 + 1):
            x[m, j, k] = row[k]


@kernel
def smooth(x: Real, b: Real, w: Triple, inverse: Real, colour: int) -> None:
    """Gauss-Seidel on the cells of one colour of the chequerboard (0: first cell's; 1: others)."""
    d = 1 if x.shape[0] > 1 else 0
    for i in prange(x.shape[0] - 2 * d):
        smooth_plane(x, b, w, inverse, colour, i + d)


def smooth_reference(x: Real, b: Real, w: Triple, inverse: Real, colour: int) -> Array:
    """`smooth` in NumPy: x after it."""
    i, j, k = np.indices(x.shape)
    chosen = (i - (x.shape[0] > 1) + j + k) % 2 == colour
    inside = cells_of(x)
    out = np.array(x, np.float64)
    out[inside] = np.where(chosen, (b + neighbour_sum(x, w)) * inverse, x)[inside]
    return out


@inlined
def begin_plane(x: Real, b: Real, inverse: Real, m: int) -> None:
    """`first_smooth` on plane m."""
    d = 1 if x.shape[0] > 1 else 0
    for j in range(x.shape[1]):
        for k in range(x.shape[2]):
            red = ((m - d + j + k) & 1) == 0
            x[m, j, k] = b[m, j, k] * inverse[m, j, k] if red else 0.0


@kernel
def first_smooth(x: Real, b: Real, inverse: Real) -> None:
    """Red sweep from x = 0: red cells b * inverse, all else and the ghosts 0."""
    for i in prange(x.shape[0]):
        begin_plane(x, b, inverse, i)


@inlined
def defect_plane(r: Real, x: Real, b: Real, w: Triple, inverse: Real, m: int) -> None:
    """`defect` on plane m."""
    w0, w1, w2 = w
    d = 1 if x.shape[0] > 1 else 0
    for j in range(1, x.shape[1] - 1):
        for k in range(1, x.shape[2] - 1):
            total = b[m, j, k] + w1[m, j, k] * x[m, j - 1, k]
            total += w1[m, j + 1, k] * x[m, j + 1, k]
            total += w2[m, j, k] * x[m, j, k - 1] + w2[m, j, k + 1] * x[m, j, k + 1]
            if d:
                total += w0[m, j, k] * x[m - 1, j, k] + w0[m + 1, j, k] * x[m + 1, j, k]
            a = inverse[m, j, k]
            r[m, j, k] = total - x[m, j, k] / a if a > 0.0 else 0.0


@kernel
def defect(r: Real, x: Real, b: Real, w: Triple, inverse: Real) -> None:
    """r = b - K x in active cells, else 0; ghosts of r are left alone."""
    d = 1 if x.shape[0] > 1 else 0
    for i in prange(x.shape[0] - 2 * d):
        defect_plane(r, x, b, w, inverse, i + d)


@kernel
def smooth_down(x: Real, r: Real, b: Real, w: Triple, inverse: Real) -> None:
    """`first_smooth`, `smooth` of colour 1 and `defect`, without periodic axes."""
    d = 1 if x.shape[0] > 1 else 0
    planes = x.shape[0] - 2 * d
    blocks = max(1, planes // BLOCK)
    for block in prange(blocks):
        start, end = reach(block, blocks, planes, 0)
        first, last = reach(block, blocks, planes, 1)
        one, two = reach(block, blocks, planes, 2)
        for i in range(start, end + 2):
            if i < end:
                begin_plane(x, b, inverse, i + d)
            if first <= i - 1 < last:
                smooth_plane(x, b, w, inverse, 1, i - 1 + d)
            if one <= i - 2 < two:
                defect_plane(r, x, b, w, inverse, i - 2 + d)
    for between in prange(blocks - 1):
        i = planes * (between + 1) // blocks
        for m in range(i - 1, i + 1):
            smooth_plane(x, b, w, inverse, 1, m + d)
        for m in range(i - 2, i + 2):
            defect_plane(r, x, b, w, inverse, m + d)


@kernel
def smooth_up(x: Real, b: Real, w: Triple, inverse: Real) -> None:
    """`smooth` of colour 1, then of colour 0, without periodic axes."""
    d = 1 if x.shape[0] > 1 else 0
    planes = x.shape[0] - 2 * d
    blocks = max(1, planes // BLOCK)
    for block in prange(blocks):
        start, end = reach(block, blocks, planes, 0)
        one, two = reach(block, blocks, planes, 1)
        for i in range(start, end + 1):
            if i < end:
                smooth_plane(x, b, w, inverse, 1, i + d)
            if one <= i - 1 < two:
                smooth_plane(x, b, w, inverse, 0, i - 1 + d)
    for between in prange(blocks - 1):
        i = planes * (between + 1) // blocks
        for m in range(i - 1, i + 1):
            smooth_plane(x, b, w, inverse, 0, m + d)


def defect_reference(x: Real, b: Real, w: Triple, inverse: Real) -> Array:
    """`defect` in NumPy, with ghosts 0."""
    r, inside = np.zeros(x.shape), cells_of(x)
    active = inverse > 0.0
    K_x = x / np.where(active, inverse, 1.0) - neighbour_sum(x, w)
    r[inside] = np.where(active, b - K_x, 0.0)[inside]
    return r
