"""The weighted cell Laplacian K on the finest level, by blocks of planes that several operations go
through together while they are in cache."""

from __future__ import annotations

import numpy as np
from numba import prange

from flowborne.kernels.arrays import Array, Operator, Real
from flowborne.kernels.even import at_cell
from flowborne.kernels.jit import inlined, kernel
from flowborne.kernels.vectors import in_order

BLOCK = 16
"""Fewest planes of a block: more than an operation leaves to when all blocks are done."""


@inlined
def reach(block: int, blocks: int, planes: int, behind: int) -> tuple[int, int]:
    """First plane, and that after the last, of a block that an operation may go through which takes
    both neighbours of a plane from the one before it, and so on `behind` times; the planes between
    two blocks are left to when all blocks are done."""
    start, end = planes * block // blocks, planes * (block + 1) // blocks
    first = start if block == 0 else start + behind
    return first, end if block == blocks - 1 else end - behind


@kernel
def apply_plane(out: Array, p: Array, operator: Operator, m: int) -> float:
    """`apply_laplacian` on plane m."""
    w0, w1, w2, diagonal, even, common = operator
    d = 1 if p.shape[0] > 1 else 0
    n2 = p.shape[2] - 2
    row = np.zeros(n2 + 2)
    c0, c1, c2 = at_cell(w0, common), at_cell(w1, common), at_cell(w2, common)
    for j in range(1, p.shape[1] - 1):
        if even[m, j]:
            for k in range(1, n2 + 1):
                total = diagonal[m, j, k] * p[m, j, k] - c1 * (p[m, j - 1, k] + p[m, j + 1, k])
                total -= c2 * (p[m, j, k - 1] + p[m, j, k + 1])
                if d:
                    total -= c0 * (p[m - 1, j, k] + p[m + 1, j, k])
                out[m, j, k] = total
                row[k] += total * p[m, j, k]
        else:
            for k in range(1, n2 + 1):
                total = diagonal[m, j, k] * p[m, j, k] - w1[m, j, k] * p[m, j - 1, k]
                total -= w1[m, j + 1, k] * p[m, j + 1, k]
                total -= w2[m, j, k] * p[m, j, k - 1] + w2[m, j, k + 1] * p[m, j, k + 1]
                if d:
                    total -= w0[m, j, k] * p[m - 1, j, k] + w0[m + 1, j, k] * p[m + 1, j, k]
                out[m, j, k] = total
                row[k] += total * p[m, j, k]
    return in_order(row)


@kernel
def apply_laplacian(out: Array, p: Array, operator: Operator) -> float:
    """out = K p; returns p . K p.  Ghosts of p hold what lies beyond the sides."""
    d = 1 if p.shape[0] > 1 else 0
    planes = p.shape[0] - 2 * d
    parts = np.zeros(planes)
    for i in prange(planes):
        parts[i] = apply_plane(out, p, operator, i + d)
    return in_order(parts)


@inlined
def turn_plane(p: Array, z: Real, scale: float, beta: float, m: int) -> None:
    """p = scale z + beta p in the cells of plane m."""
    for j in range(1, p.shape[1] - 1):
        for k in range(1, p.shape[2] - 1):
            p[m, j, k] = scale * z[m, j, k] + beta * p[m, j, k]


@kernel
def turn_and_apply(
    out: Array, p: Array, z: Real, scale: float, beta: float, operator: Operator
) -> float:
    """p = scale z + beta p in the cells, then out = K p; returns p . K p. Without periodic axes.

    z  may be `out`
    """
    d = 1 if p.shape[0] > 1 else 0
    planes = p.shape[0] - 2 * d
    parts = np.zeros(planes)
    blocks = max(1, planes // BLOCK)
    for block in prange(blocks):
        start, end = reach(block, blocks, planes, 0)
        one, two = reach(block, blocks, planes, 1)
        for i in range(start, end + 1):
            if i < end:
                turn_plane(p, z, scale, beta, i + d)
            if one <= i - 1 < two:
                parts[i - 1] = apply_plane(out, p, operator, i - 1 + d)
    for between in prange(blocks - 1):
        i = planes * (between + 1) // blocks
        for m in range(i - 1, i + 1):
            parts[m] = apply_plane(out, p, operator, m + d)
    return in_order(parts)
