"""Which coarse cell stands for each fine cell.

Usually the one that covers it. But a thin plate may cut the fine cells under one coarse cell into
parts that do not touch, and a coarse cell that stood for both sides would let pressure leak through
the plate on every coarser level. So the largest part keeps the coarse cell, and a fine cell of the
others goes with its neighbour beyond the coarse cell's side, if that one kept its own; it is then
called a orphan there. Fine cells that find no such neighbour are left to the smoother.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from flowborne.kernels.arrays import Integers, Marks, Real, Triple
from flowborne.kernels.jit import kernel

OWN = 8
"""Mark of a fine cell that belongs to the coarse cell over it; marks 1, 2 and 4 besides: it may
also interpolate from the next coarse cell along that axis. Ghosts are marked as well."""

CUT, ACTIVE = 1, 2
"""What there is among the fine cells under a coarse one: cells that do not touch, active cells."""

WEAK = 0.02
"""Cells are taken as touching when the face between them has more than this share of the sum of
face weights of one of them."""


@kernel
def mark_own(marks: Marks, w: Triple, inverse: Real, factor: Integers) -> None:
    """Mark the largest connected part of the fine cells under each coarse cell as OWN.

    factor  fine cells in a coarse one along each axis, 1 or 2
    """
    w0, w1, w2 = w
    f0, f1, f2 = factor
    d = 1 if inverse.shape[0] > 1 else 0
    n0, n1, n2 = inverse.shape[0] - 2 * d, inverse.shape[1] - 2, inverse.shape[2] - 2
    blocks = (n0 + f0 - 1) // f0
    for block in prange(blocks):
        state = np.empty(n2 + 2, np.uint8)
        first0 = f0 * block + d
        end0 = min(first0 + f0, n0 + d)
        for first1 in range(1, n1 + 1, f1):
            end1 = min(first1 + f1, n1 + 1)
            state[:] = 0
            for i in range(first0, end0):
                for j in range(first1, end1):
                    for k in range(1, n2 + 1):
                        share = inverse[i, j, k]
                        whole = (i == first0) | (w0[i, j, k] * share > WEAK)
                        whole &= (j == first1) | (w1[i, j, k] * share > WEAK)
                        whole &= ((k - 1) & (f2 - 1) == 0) | (w2[i, j, k] * share > WEAK)
                        active = share > 0.0
                        state[k] |= (0 if whole & active else CUT) | (ACTIVE if active else 0)
                        marks[i, j, k] = OWN if active else 0
            for first2 in range(1, n2 + 1, f2):
                end2 = min(first2 + f2, n2 + 1)
                if state[first2] | state[end2 - 1] == CUT | ACTIVE:
                    mark_largest(marks, w, inverse, (first0, first1, first2), (end0, end1, end2))


@kernel
def mark_largest(
    marks: Marks,
    w: Triple,
    inverse: Real,
    first: tuple[int, int, int],
    end: tuple[int, int, int],
) -> None:
    """Mark the largest connected part of at most 2 x 2 x 2 cells as OWN, the others as 0."""
    w0, w1, w2 = w
    part, size = np.full(8, -1), np.zeros(8, np.int64)
    for i in range(first[0], end[0]):
        for j in range(first[1], end[1]):
            for k in range(first[2], end[2]):
                if inverse[i, j, k] > 0.0:
                    n = 4 * (i - first[0]) + 2 * (j - first[1]) + k - first[2]
                    part[n] = n
    changed = True
    while changed:
        changed = False
        for n in range(8):
            i, j, k = first[0] + (n >> 2), first[1] + ((n >> 1) & 1), first[2] + (n & 1)
            for axis in range(3):
                m = n ^ (4 >> axis)
                if m > n or part[n] < 0 or part[m] < 0 or part[n] == part[m]:
                    continue
                if axis == 0:
                    share = w0[i, j, k] * max(inverse[i, j, k], inverse[i - 1, j, k])
                elif axis == 1:
                    share = w1[i, j, k] * max(inverse[i, j, k], inverse[i, j - 1, k])
                else:
                    share = w2[i, j, k] * max(inverse[i, j, k], inverse[i, j, k - 1])
                if share > WEAK:
                    part[n] = part[m] = min(part[n], part[m])
                    changed = True
    for n in range(8):
        if part[n] >= 0:
            size[part[n]] += 1
    best = 0
    for n in range(1, 8):
        if size[n] > size[best]:
            best = n
    for i in range(first[0], end[0]):
        for j in range(first[1], end[1]):
            for k in range(first[2], end[2]):
                n = 4 * (i - first[0]) + 2 * (j - first[1]) + k - first[2]
                marks[i, j, k] = OWN if part[n] == best else 0


@kernel
def mark_interpolated(marks: Marks, w: Triple, inverse: Real, interpolation: Triple) -> None:
    """Add 1, 2, 4 where the cell towards the next coarse cell along an axis touches and is OWN.

    Beyond an open side pressure is 0, and that is interpolated from as well.
    """
    w0, w1, w2 = w
    towards0, towards1, towards2 = interpolation
    d = 1 if marks.shape[0] > 1 else 0
    p2 = marks.shape[2]
    for plane in prange(marks.shape[0] - 2 * d):
        i = plane + d
        s0 = 1 if towards0[plane + 1] > 0.0 else 0
        next0 = i + d * (2 * s0 - 1)
        row = np.empty(p2, marks.dtype)
        for j in range(1, marks.shape[1] - 1):
            s1 = 1 if towards1[j] > 0.0 else 0
            next1 = j + 2 * s1 - 1
            for k in range(1, p2 - 1):
                share = inverse[i, j, k]
                up = towards2[k] > 0.0
                weight = w2[i, j, k + 1] if up else w2[i, j, k]
                beyond = marks[i, j, k + 1] if up else marks[i, j, k - 1]
                mark = 4 if (weight * share > WEAK) & (beyond >= OWN) else 0
                if (w1[i, j + s1, k] * share > WEAK) & (marks[i, next1, k] >= OWN):
                    mark += 2
                if (w0[i + s0 * d, j, k] * share > WEAK) & (marks[next0, j, k] >= OWN):
                    mark += d
                row[k] = mark + OWN if marks[i, j, k] >= OWN else 0
            for k in range(1, p2 - 1):
                marks[i, j, k] = row[k]
