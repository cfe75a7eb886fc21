"""One symmetric V-cycle on K: the preconditioner of the pressure solve.

Both ways it smooths by the same polynomial in D^-1 K, so that the cycle is a symmetric positive
definite operator.

Interpolation between two levels is linear along each axis,

    p_f = p_C + sum over axes of  c (p_next - p_C)      only where nothing lies between

with C the coarse cell that covers f and `next` the one towards which f lies from its centre (four
coarse values in 3D; Khalil and Wesseling 1992 use the same points). Cells that a thin plate cuts
off from C have the value of another coarse cell (see `aggregates`). Restriction is its transpose.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from flowborne.kernels.aggregates import OWN
from flowborne.kernels.arrays import Hierarchy, Indices, Marks, Real, Triple
from flowborne.kernels.jit import inlined, kernel
from flowborne.kernels.levels import (
    COMMON,
    OFFSET,
    at_level,
    even_at,
    interpolation_at,
    orphans_at,
    weights_at,
    wrap_ghosts,
)
from flowborne.kernels.smoothing import (
    STEPS,
    WEIGHTS,
    first_smooth,
    smooth,
    smooth_down,
    smooth_often,
    smooth_up,
)


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


COARSEST = 15
"""Times that all steps are made on the coarsest level, of at most 4 cells along an axis; odd."""

SERIAL = 40_000
"""Cells of a level, ghosts included, below which threads would cost more than they save."""


@kernel
def leg(hierarchy: Hierarchy, x: Real, b: Real, r: Real, level: int, down: bool) -> None:
    """The cycle's work on one level, on its way down (from x = 0, then b of the next level) or up
    (from x of the next level)."""
    table, periodic, weights, _, inverse, even, interpolation, marks, orphans, aggregates = (
        hierarchy
    )
    coarsest = table.shape[0] - 2
    (w0, w1, w2), a = weights_at(weights, table, level), at_level(inverse, table, level)
    operator = (w0, w1, w2, a, even_at(even, table, level), table[level, COMMON])
    xl, bl = at_level(x, table, level), at_level(b, table, level)
    rl = at_level(r, table, level)
    fine = not periodic.any() and level < coarsest
    between = (
        at_level(marks, table, level),
        interpolation_at(interpolation, table, level),
        orphans_at(orphans, table, level),
        at_level(aggregates, table, level),
    )
    if not down:
        interpolate(rl, xl, at_level(x, table, level + 1), *between)
    if fine and down:
        smooth_down(xl, rl, bl, operator)
    elif fine:
        smooth_up(xl, rl, bl, operator)
    else:
        if down:
            first_smooth(xl, bl, a)
        here, there = (xl, rl) if down else (rl, xl)
        steps = STEPS * COARSEST if level == coarsest else STEPS
        if level == coarsest and not periodic.any():
            smooth_often(xl, rl, bl, operator, steps)
            return
        for n in range(1 if down else 0, steps):
            wrap_ghosts(here, periodic)
            smooth(there, here, bl, operator, WEIGHTS[n % STEPS if down else STEPS - 1 - n])
            here, there = there, here
        wrap_ghosts(xl, periodic)
        if down and level < coarsest:
            smooth(rl, xl, bl, operator, None)
            wrap_ghosts(rl, periodic)
    if down and level < coarsest:
        restrict(at_level(b, table, level + 1), rl, *between)


serial_leg = leg.inner
"""For levels too small for threads, in the cycle's parallel twin as well."""


@kernel
def v_cycle(hierarchy: Hierarchy, x: Real, b: Real, r: Real) -> None:
    """x = V b on the finest level, V symmetric positive definite, close to the inverse of K.

    x, b, r  packed over the levels; b's finest level is given, all else is overwritten
    """
    table = hierarchy[0]
    coarsest = table.shape[0] - 2
    for n in range(2 * coarsest + 1):
        down = n <= coarsest
        level = n if down else 2 * coarsest - n
        if table[level + 1, OFFSET] - table[level, OFFSET] < SERIAL:
            serial_leg(hierarchy, x, b, r, level, down)
        else:
            leg(hierarchy, x, b, r, level, down)
