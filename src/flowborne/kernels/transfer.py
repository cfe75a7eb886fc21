"""Interpolation between two levels, and restriction, its transpose.

Interpolation is linear along each axis,

    p_f = p_C + sum over axes of  c (p_next - p_C)      only where nothing lies between

with C the coarse cell that covers f and `next` the one towards which f lies from its centre (four
coarse values in 3D; Khalil and Wesseling 1992 use the same points). Cells that a thin plate cuts
off from C have the value of another coarse cell (see `aggregates`).
"""

from __future__ import annotations

import numpy as np
from numba import prange

from flowborne.kernels.aggregates import OWN
from flowborne.kernels.arrays import Indices, Marks, Real, Triple
from flowborne.kernels.jit import inlined, kernel


@kernel
def interpolate(
    out: Real,
    x: Real,
    coarse: Real,
    marks: Marks,
    interpolation: Triple,
    orphans: Indices,
    aggregates: Indices,
) -> None:
    """out = x + P coarse; ghosts of `coarse` hold what lies beyond."""
    towards0, towards1, towards2 = interpolation
    d = 1 if x.shape[0] > 1 else 0
    h0 = 2 if x.shape[0] > coarse.shape[0] else 1
    h1 = 2 if x.shape[1] > coarse.shape[1] else 1
    h2 = 2 if x.shape[2] > coarse.shape[2] else 1
    n2 = x.shape[2] - 2
    pairs = n2 // 2 if h2 == 2 else 0
    none = x.dtype.type(0)
    for i in prange(x.shape[0] - 2 * d):
        m, c0 = i + d, i // h0 + d
        next0 = c0 + d * (1 if towards0[i + 1] > 0.0 else -1)
        for j in range(1, x.shape[1] - 1):
            c1 = (j - 1) // h1 + 1
            next1 = c1 + (1 if towards1[j] > 0.0 else -1)
            for c in range(1, pairs + 1):
                k = 2 * c - 1
                own = coarse[c0, c1, c]
                along0 = abs(towards0[i + 1]) * (coarse[next0, c1, c] - own)
                along1 = abs(towards1[j]) * (coarse[c0, next1, c] - own)
                low = abs(towards2[k]) * (coarse[c0, c1, c - 1] - own)
                high = abs(towards2[k + 1]) * (coarse[c0, c1, c + 1] - own)
                mark = marks[m, j, k]
                first = own if mark & OWN else none
                first += along1 if mark & 2 else none
                first += low if mark & 4 else none
                first += along0 if mark & 1 else none
                mark = marks[m, j, k + 1]
                second = own if mark & OWN else none
                second += along1 if mark & 2 else none
                second += high if mark & 4 else none
                second += along0 if mark & 1 else none
                out[m, j, k] = x[m, j, k] + first
                out[m, j, k + 1] = x[m, j, k + 1] + second
            for k in range(2 * pairs + 1, n2 + 1):
                c = (k - 1) // h2 + 1
                own = coarse[c0, c1, c]
                mark = marks[m, j, k]
                value = own if mark & OWN else none
                value += abs(towards1[j]) * (coarse[c0, next1, c] - own) if mark & 2 else none
                value += abs(towards0[i + 1]) * (coarse[next0, c1, c] - own) if mark & 1 else none
                out[m, j, k] = x[m, j, k] + value
    fine, wide, aggregate = out.reshape(-1), coarse.reshape(-1), aggregates.reshape(-1)
    for g in range(orphans.size):
        fine[orphans[g]] += wide[aggregate[orphans[g]]]


@inlined
def add_interpolated(
    row: Real, r: Real, marks: Marks, m: int, j: int, mark: int, part: float
) -> None:
    """row += part * r of the row (m, j) where the cells have this mark."""
    share, none = row.dtype.type(part), row.dtype.type(0)
    for k in range(1, row.size - 1):
        row[k] += share * r[m, j, k] if marks[m, j, k] & mark else none


@kernel
def restrict(
    b: Real, r: Real, marks: Marks, interpolation: Triple, orphans: Indices, aggregates: Indices
) -> None:
    """b = P^T r on the coarse cells; ghosts of r hold 0, or the opposite side's values."""
    towards0, towards1, towards2 = interpolation
    d = 1 if r.shape[0] > 1 else 0
    n0, n1, n2 = r.shape[0] - 2 * d, r.shape[1] - 2, r.shape[2] - 2
    h0 = 2 if r.shape[0] > b.shape[0] else 1
    h1 = 2 if r.shape[1] > b.shape[1] else 1
    h2 = 2 if r.shape[2] > b.shape[2] else 1
    pairs = n2 // 2 if h2 == 2 else 0
    none = r.dtype.type(0)
    for plane in prange(b.shape[0] - 2 * d):
        first0, end0 = h0 * plane + d, min(h0 * plane + h0, n0) + d
        row, across = np.empty(n2 + 2, r.dtype), np.empty(n2 + 2, r.dtype)
        for c1 in range(1, b.shape[1] - 1):
            first1, end1 = h1 * (c1 - 1) + 1, min(h1 * c1, n1) + 1
            row[:] = 0.0
            across[:] = 0.0
            for m in range(first0, end0):
                part0 = abs(towards0[m + 1 - d])
                for j in range(first1, end1):
                    part1 = abs(towards1[j])
                    for k in range(1, n2 + 1):
                        value, mark = r[m, j, k], marks[m, j, k]
                        gone = abs(towards2[k]) * value if mark & 4 else none
                        across[k] += gone
                        keep = (value if mark & OWN else none) - gone
                        keep -= part1 * value if mark & 2 else none
                        keep -= part0 * value if mark & 1 else none
                        row[k] += keep
                if towards1[first1 - 1] > 0.0:
                    add_interpolated(row, r, marks, m, first1 - 1, 2, towards1[first1 - 1])
                if towards1[end1] < 0.0:
                    add_interpolated(row, r, marks, m, end1, 2, -towards1[end1])
            if d:
                low, high = towards0[first0 - 1], towards0[end0]
                for j in range(first1, end1):
                    if low > 0.0:
                        add_interpolated(row, r, marks, first0 - 1, j, 1, low)
                    if high < 0.0:
                        add_interpolated(row, r, marks, end0, j, 1, -high)
            across[0] = across[n2] if towards2[0] > 0.0 else none
            across[n2 + 1] = across[1] if towards2[n2 + 1] < 0.0 else none
            for c in range(1, pairs + 1):
                total = row[2 * c - 1] + row[2 * c]
                b[plane + d, c1, c] = total + across[2 * c - 2] + across[2 * c + 1]
            for c in range(pairs + 1, b.shape[2] - 1):
                k = h2 * (c - 1) + 1
                b[plane + d, c1, c] = row[k] + across[k - 1] + across[k + 1]
    wide, fine, aggregate = b.reshape(-1), r.reshape(-1), aggregates.reshape(-1)
    for g in range(orphans.size):
        wide[aggregate[orphans[g]]] += fine[orphans[g]]
