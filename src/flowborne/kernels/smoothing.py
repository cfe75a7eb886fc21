"""The weighted cell Laplacian K and Chebyshev smoothing on one level, by blocks of planes that
several operations go through together while they are in cache.

Steps of Jacobi's method with a weight of their own each,

    x <- x + w_k D^-1 (b - K x)        w_k = 1 / (1 - cos(2 pi k / (2 n + 1)))     k = 1 ... n

D the diagonal of K, multiply the error by the polynomial of Chebyshev's fourth kind in D^-1 K whose
eigenvalues lie between 0 and 2, the best of n steps in a V-cycle that is known without the smallest
one that they are to damp (Lottes 2023). Two sweeps by colours cost more than three steps, half of
whose results they throw away, and damp less.

Rows are worked on whole and without branches, so that the compiler makes vector code of them. It
makes none where the sums over neighbours are a function of their own (19 ns a cell for 1.6).
"""

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


STEPS = 3
"""Steps on the way down and on the way up, odd: they go from one array into the other and back."""

WEIGHTS = tuple(1.0 / (1.0 - np.cos(2.0 * np.pi * k / (2 * STEPS + 1))) for k in (1, 2, 3))
"""The weights w_k."""


@kernel
def smooth_plane(
    out: Real, x: Real, b: Real, operator: Operator, weight: float | None, m: int
) -> None:
    """`smooth` on plane m."""
    w0, w1, w2, inverse, even, common = operator
    d = 1 if x.shape[0] > 1 else 0
    if weight is not None:
        part, keep = x.dtype.type(weight), x.dtype.type(1.0 - weight)
    c0, c1, c2 = at_cell(w0, common), at_cell(w1, common), at_cell(w2, common)
    for j in range(1, x.shape[1] - 1):
        if even[m, j]:
            for k in range(1, x.shape[2] - 1):
                total = b[m, j, k] + c1 * (x[m, j - 1, k] + x[m, j + 1, k])
                total += c2 * (x[m, j, k - 1] + x[m, j, k + 1])
                if d:
                    total += c0 * (x[m - 1, j, k] + x[m + 1, j, k])
                if weight is None:
                    out[m, j, k] = total - np.divide(x[m, j, k], inverse[m, j, k])
                else:
                    out[m, j, k] = keep * x[m, j, k] + part * inverse[m, j, k] * total
        else:
            for k in range(1, x.shape[2] - 1):
                total = b[m, j, k] + w1[m, j, k] * x[m, j - 1, k]
                total += w1[m, j + 1, k] * x[m, j + 1, k]
                total += w2[m, j, k] * x[m, j, k - 1] + w2[m, j, k + 1] * x[m, j, k + 1]
                if d:
                    total += w0[m, j, k] * x[m - 1, j, k] + w0[m + 1, j, k] * x[m + 1, j, k]
                a = inverse[m, j, k]
                if weight is None:
                    left = total - np.divide(x[m, j, k], a)  # no check for 0: vector code
                    out[m, j, k] = left if a > 0.0 else x.dtype.type(0)
                else:
                    out[m, j, k] = keep * x[m, j, k] + part * a * total


@kernel
def smooth(out: Real, x: Real, b: Real, operator: Operator, weight: float | None) -> None:
    """out = x after a step with a weight w_k; without one what x leaves, b - K x in active cells
    and else 0. Ghosts of `out` are left alone."""
    d = 1 if x.shape[0] > 1 else 0
    for i in prange(x.shape[0] - 2 * d):
        smooth_plane(out, x, b, operator, weight, i + d)


@kernel
def smooth_often(x: Real, r: Real, b: Real, operator: Operator, steps: int) -> None:
    """`smooth` on the coarsest level, without periodic axes, from its second step on, from x to r
    and back. By a list of cells: rows of four are too short for vector code."""
    w0, w1, w2, inverse, even, common = operator
    d, (p0, p1, p2) = int(x.shape[0] > 1), x.shape
    c0, c1, c2 = at_cell(w0, common), at_cell(w1, common), at_cell(w2, common)
    count, far, wide = (p0 - 2 * d) * (p1 - 2) * (p2 - 2), d * p1 * p2, p2
    at, same = np.empty(count, np.int64), np.empty(count, np.uint8)
    w, part = np.empty((7, count), x.dtype), np.empty((STEPS, count), x.dtype)
    n = 0
    for m in range(d, p0 - d):
        for j in range(1, p1 - 1):
            for k in range(1, p2 - 1):
                at[n], same[n], w[0, n] = (m * p1 + j) * p2 + k, even[m, j], b[m, j, k]
                w[1, n], w[2, n] = w1[m, j, k], w1[m, j + 1, k]
                w[3, n], w[4, n] = w2[m, j, k], w2[m, j, k + 1]
                w[5, n], w[6, n] = w0[m, j, k], w0[m + d, j, k]
                for step in range(STEPS):
                    part[step, n] = x.dtype.type(WEIGHTS[step]) * inverse[m, j, k]
                n += 1
    here, there = x.reshape(-1), r.reshape(-1)
    for turn in range(1, steps):
        step = turn % STEPS
        keep = x.dtype.type(1.0 - WEIGHTS[step])
        for n in range(count):
            c = at[n]
            if same[n]:
                total = w[0, n] + c1 * (here[c - wide] + here[c + wide])
                total += c2 * (here[c - 1] + here[c + 1])
                if d:
                    total += c0 * (here[c - far] + here[c + far])
            else:
                total = w[0, n] + w[1, n] * here[c - wide]
                total += w[2, n] * here[c + wide]
                total += w[3, n] * here[c - 1] + w[4, n] * here[c + 1]
                if d:
                    total += w[5, n] * here[c - far] + w[6, n] * here[c + far]
            there[c] = keep * here[c] + part[step, n] * total
        here, there = there, here


@kernel
def begin_plane(x: Real, b: Real, inverse: Real, m: int) -> None:
    """`first_smooth` on plane m."""
    part = x.dtype.type(WEIGHTS[0])
    for j in range(x.shape[1]):
        for k in range(x.shape[2]):
            x[m, j, k] = part * inverse[m, j, k] * b[m, j, k]


@kernel
def first_smooth(x: Real, b: Real, inverse: Real) -> None:
    """The first step, from x = 0; ghosts 0."""
    for i in prange(x.shape[0]):
        begin_plane(x, b, inverse, i)


@kernel
def smooth_down(x: Real, r: Real, b: Real, operator: Operator) -> None:
    """All steps from x = 0, and r what they leave, without periodic axes; r holds every other step
    meanwhile."""
    d = 1 if x.shape[0] > 1 else 0
    planes = x.shape[0] - 2 * d
    blocks = max(1, planes // BLOCK)
    for block in prange(blocks):
        start, end = reach(block, blocks, planes, 0)
        first, last = reach(block, blocks, planes, 1)
        one, two = reach(block, blocks, planes, 2)
        low, high = reach(block, blocks, planes, 3)
        for i in range(start, end + 3):
            if i < end:
                begin_plane(x, b, operator[3], i + d)
            if first <= i - 1 < last:
                smooth_plane(r, x, b, operator, WEIGHTS[1], i - 1 + d)
            if one <= i - 2 < two:
                smooth_plane(x, r, b, operator, WEIGHTS[2], i - 2 + d)
            if low <= i - 3 < high:
                smooth_plane(r, x, b, operator, None, i - 3 + d)
    for between in prange(blocks - 1):
        i = planes * (between + 1) // blocks
        for m in range(i - 1, i + 1):
            smooth_plane(r, x, b, operator, WEIGHTS[1], m + d)
        for m in range(i - 2, i + 2):
            smooth_plane(x, r, b, operator, WEIGHTS[2], m + d)
        for m in range(i - 3, i + 3):
            smooth_plane(r, x, b, operator, None, m + d)


@kernel
def smooth_up(x: Real, r: Real, b: Real, operator: Operator) -> None:
    """x = r after all steps, the last one first, without periodic axes; r holds every other step
    meanwhile."""
    d = 1 if x.shape[0] > 1 else 0
    planes = x.shape[0] - 2 * d
    blocks = max(1, planes // BLOCK)
    for block in prange(blocks):
        start, end = reach(block, blocks, planes, 0)
        first, last = reach(block, blocks, planes, 1)
        one, two = reach(block, blocks, planes, 2)
        for i in range(start, end + 2):
            if i < end:
                smooth_plane(x, r, b, operator, WEIGHTS[2], i + d)
            if first <= i - 1 < last:
                smooth_plane(r, x, b, operator, WEIGHTS[1], i - 1 + d)
            if one <= i - 2 < two:
                smooth_plane(x, r, b, operator, WEIGHTS[0], i - 2 + d)
    for between in prange(blocks - 1):
        i = planes * (between + 1) // blocks
        for m in range(i - 1, i + 1):
            smooth_plane(r, x, b, operator, WEIGHTS[1], m + d)
        for m in range(i - 2, i + 2):
            smooth_plane(x, r, b, operator, WEIGHTS[0], m + d)
