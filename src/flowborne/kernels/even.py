"""Even rows: all their cells have the same weights, as most of a grid where no body is near.

There a stencil needs no weights from memory, which is what an iteration waits for.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from flowborne.kernels.arrays import Marks, Periodic, Real, Triple
from flowborne.kernels.jit import inlined, kernel

ROUNDING = 1e-12
"""Relative difference of weights that is taken for none: weights of open faces differ by as much,
through what solves leave in the volumes. What it changes in K p shows in fluid at rest, where the
velocity should be 0: over g dt F5 has 3e-13 with equal weights alone, 2e-12 with this, and 1.5e-10
with ten times as much."""

SINGLE = 1e-6
"""The same in single precision, in the preconditioner."""


@inlined
def at_cell(values: Real, cell: int) -> float:
    """Value at a padded flat index."""
    return values.reshape(-1)[cell]


@inlined
def differ(a: float, b: float, rounding: float) -> bool:
    return abs(a - b) > rounding * b


@inlined
def differs(w: Real, i: int, j: int, first: int, common: float, rounding: float) -> bool:
    """Whether some weight of row (i, j) from `first` on is another one than the common one."""
    found, row = 0, w[i, j, first:-1]
    for k in range(row.size):
        found += int(abs(row[k] - common) > rounding * common)
    return found > 0


@inlined
def common_cell(w: Triple, rounding: float) -> tuple[int, int, int]:
    """The first cell that has the same weight on both sides along each axis, above 0; (-1, 0, 0) if
    there is none."""
    w0, w1, w2 = w
    d = 1 if w0.shape[0] > 1 else 0
    for m in range(d, w0.shape[0] - d):
        for j in range(1, w0.shape[1] - 1):
            for k in range(1, w0.shape[2] - 1):
                same = w1[m, j, k] > 0.0 and w2[m, j, k] > 0.0
                same = same and not differ(w1[m, j + 1, k], w1[m, j, k], rounding)
                same = same and not differ(w2[m, j, k + 1], w2[m, j, k], rounding)
                if d:
                    same = same and w0[m, j, k] > 0.0
                    same = same and not differ(w0[m + 1, j, k], w0[m, j, k], rounding)
                if same:
                    return m, j, k
    return -1, 0, 0


@kernel
def find_even(w: Triple, periodic: Periodic, even: Marks, rounding: float) -> int:
    """Mark the rows of which every cell has the weights of a common cell, and return its padded
    flat index.

    A weight does not count where nothing lies behind it but the ghosts of a side, which hold 0.
    Diagonals, which are read in any case, may differ.

    even      of each padded row, 1 or 0
    rounding  relative difference of weights that is none
    """
    w0, w1, w2 = w
    d = 1 if w0.shape[0] > 1 else 0
    n1, n2 = w0.shape[1] - 2, w0.shape[2] - 2
    even[:] = 0
    a, b, c = common_cell(w, rounding)
    if a < 0:
        return 0
    c0, c1, c2 = w0[a, b, c], w1[a, b, c], w2[a, b, c]
    others = np.zeros((3, w0.shape[0], n1 + 2), np.bool_)  # rows of faces with other weights
    for m in prange(w0.shape[0]):
        for j in range(1, n1 + 2):
            others[0, m, j] = d > 0 and differs(w0, m, j, 1, c0, rounding)
            others[1, m, j] = differs(w1, m, j, 1, c1, rounding)
            others[2, m, j] = differs(w2, m, j, 2, c2, rounding)
            if periodic[2]:
                others[2, m, j] |= differ(w2[m, j, 1], c2, rounding)
                others[2, m, j] |= differ(w2[m, j, n2 + 1], c2, rounding)
    for m in range(d, w0.shape[0] - d):
        for j in range(1, n1 + 1):
            other = others[2, m, j] or (others[0, m, j] and (periodic[0] or m > d))
            other = other or (others[1, m, j] and (periodic[1] or j > 1))
            other = other or (others[1, m, j + 1] and (periodic[1] or j < n1))
            if d:
                last = m == w0.shape[0] - 2 and not periodic[0]
                other = other or (others[0, m + 1, j] and not last)
            even[m, j] = 0 if other else 1
    return (a * w0.shape[1] + b) * w0.shape[2] + c
