"""One symmetric V-cycle on K: the preconditioner of the pressure solve.

Red-black Gauss-Seidel, red first on the way down and black first on the way up, so that the cycle
is a symmetric positive definite operator. Interpolation is linear along each axis,

    p_f = p_C + sum over axes of  c (p_next - p_C)      only where nothing lies between

with C the coarse cell that covers f and `next` the one towards which f lies from its centre (four
coarse values in 3D; Khalil and Wesseling 1992 use the same points); restriction is its transpose.
Cells that a thin plate cuts off from C have the value of another coarse cell (see `aggregates`).

Rows are worked on whole and without branches, so that the compiler makes vector code of them.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from flowborne.fluid.aggregates import OWN
from flowborne.fluid.arrays import Hierarchy, Marks, Places, Real, Triple
from flowborne.fluid.jit import kernel
from flowborne.fluid.levels import (
    OFFSET,
    at_level,
    guests_at,
    leaning_at,
    weights_at,
    wrap_ghosts,
)

COARSEST_SWEEPS = 8
"""Symmetric sweeps on the coarsest level, of at most 4 cells along an axis."""

SERIAL = 40_000
"""Cells of a level, ghosts included, below which threads would cost more than they save."""


@kernel
def smooth(x: Real, b: Real, w: Triple, inverse: Real, colour: int) -> None:
    """Gauss-Seidel on the cells of one colour of the chequerboard (0: first cell's; 1: others).

    NumPy:  x[colour] = ((b + sum over faces of w x_neighbour) * inverse)[colour]
    """
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


@kernel
def interpolate(
    x: Real, coarse: Real, marks: Marks, lean: Triple, guests: Places, hosts: Places
) -> None:
    """x += P coarse; ghosts of `coarse` hold what lies beyond."""
    lean0, lean1, lean2 = lean
    d = 1 if x.shape[0] > 1 else 0
    h0 = 2 if x.shape[0] > coarse.shape[0] else 1
    h1 = 2 if x.shape[1] > coarse.shape[1] else 1
    h2 = 2 if x.shape[2] > coarse.shape[2] else 1
    n2 = x.shape[2] - 2
    pairs = n2 // 2 if h2 == 2 else 0
    none = x.dtype.type(0)
    for i in prange(x.shape[0] - 2 * d):
        m, c0 = i + d, i // h0 + d
        next0 = c0 + d * (1 if lean0[i + 1] > 0.0 else -1)
        for j in range(1, x.shape[1] - 1):
            c1 = (j - 1) // h1 + 1
            next1 = c1 + (1 if lean1[j] > 0.0 else -1)
            for c in range(1, pairs + 1):
                k = 2 * c - 1
                own = coarse[c0, c1, c]
                along0 = abs(lean0[i + 1]) * (coarse[next0, c1, c] - own)
                along1 = abs(lean1[j]) * (coarse[c0, next1, c] - own)
                low = abs(lean2[k]) * (coarse[c0, c1, c - 1] - own)
                high = abs(lean2[k + 1]) * (coarse[c0, c1, c + 1] - own)
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
                x[m, j, k] += first
                x[m, j, k + 1] += second
            for k in range(2 * pairs + 1, n2 + 1):
                c = (k - 1) // h2 + 1
                own = coarse[c0, c1, c]
                mark = marks[m, j, k]
                value = own if mark & OWN else none
                value += abs(lean1[j]) * (coarse[c0, next1, c] - own) if mark & 2 else none
                value += abs(lean0[i + 1]) * (coarse[next0, c1, c] - own) if mark & 1 else none
                x[m, j, k] += value
    fine, wide, host = x.reshape(-1), coarse.reshape(-1), hosts.reshape(-1)
    for g in range(guests.size):
        fine[guests[g]] += wide[host[guests[g]]]


@kernel
def add_leaning(row: Real, r: Real, marks: Marks, mark: int, fraction: float) -> None:
    """row += fraction * r where the cells have this mark."""
    part = row.dtype.type(fraction)
    for k in range(1, row.size - 1):
        row[k] += part * r[k] if marks[k] & mark else row.dtype.type(0)


@kernel
def restrict(b: Real, r: Real, marks: Marks, lean: Triple, guests: Places, hosts: Places) -> None:
    """b = P^T r on the coarse cells; ghosts of r hold 0, or the opposite side's values."""
    lean0, lean1, lean2 = lean
    d = 1 if r.shape[0] > 1 else 0
    n0, n1, n2 = r.shape[0] - 2 * d, r.shape[1] - 2, r.shape[2] - 2
    h0 = 2 if r.shape[0] > b.shape[0] else 1
    h1 = 2 if r.shape[1] > b.shape[1] else 1
    h2 = 2 if r.shape[2] > b.shape[2] else 1
    none = r.dtype.type(0)
    for plane in prange(b.shape[0] - 2 * d):
        first0, end0 = h0 * plane + d, min(h0 * plane + h0, n0) + d
        row, across = np.empty(n2 + 2, r.dtype), np.empty(n2 + 2, r.dtype)
        for c1 in range(1, b.shape[1] - 1):
            first1, end1 = h1 * (c1 - 1) + 1, min(h1 * c1, n1) + 1
            row[:] = 0.0
            across[:] = 0.0
            for m in range(first0, end0):
                part0 = abs(lean0[m + 1 - d])
                for j in range(first1, end1):
                    part1 = abs(lean1[j])
                    for k in range(1, n2 + 1):
                        value, mark = r[m, j, k], marks[m, j, k]
                        gone = abs(lean2[k]) * value if mark & 4 else none
                        across[k] += gone
                        keep = (value if mark & OWN else none) - gone
                        keep -= part1 * value if mark & 2 else none
                        keep -= part0 * value if mark & 1 else none
                        row[k] += keep
                if lean1[first1 - 1] > 0.0:
                    add_leaning(row, r[m, first1 - 1], marks[m, first1 - 1], 2, lean1[first1 - 1])
                if lean1[end1] < 0.0:
                    add_leaning(row, r[m, end1], marks[m, end1], 2, -lean1[end1])
            if d:
                low, high = lean0[first0 - 1], lean0[end0]
                for j in range(first1, end1):
                    if low > 0.0:
                        add_leaning(row, r[first0 - 1, j], marks[first0 - 1, j], 1, low)
                    if high < 0.0:
                        add_leaning(row, r[end0, j], marks[end0, j], 1, -high)
            across[0], across[n2 + 1] = across[n2], across[1]
            for c in range(1, b.shape[2] - 1):
                k, last = h2 * (c - 1) + 1, min(h2 * c, n2)
                total = row[k]
                if last > k:
                    total += row[last]
                if lean2[k - 1] > 0.0:
                    total += across[k - 1]
                if lean2[last + 1] < 0.0:
                    total += across[last + 1]
                b[plane + d, c1, c] = total
    wide, fine, host = b.reshape(-1), r.reshape(-1), hosts.reshape(-1)
    for g in range(guests.size):
        wide[host[guests[g]]] += fine[guests[g]]


@kernel
def leg(hierarchy: Hierarchy, x: Real, b: Real, r: Real, level: int, down: bool) -> None:
    """The cycle's work on one level, on its way down (from x = 0, then b of the next level) or up
    (from x of the next level)."""
    table, periodic, weights, _, inverse, lean, marks, guests, hosts = hierarchy
    coarsest = table.shape[0] - 2
    w, a = weights_at(weights, table, level), at_level(inverse, table, level)
    xl, bl = at_level(x, table, level), at_level(b, table, level)
    if down:
        first_smooth(xl, bl, a)
        sweeps = 1 if level < coarsest else 4 * COARSEST_SWEEPS - 1
    else:
        interpolate(
            xl,
            at_level(x, table, level + 1),
            at_level(marks, table, level),
            leaning_at(lean, table, level),
            guests_at(guests, table, level),
            at_level(hosts, table, level),
        )
        sweeps = 2
    for n in range(sweeps):
        wrap_ghosts(xl, periodic)
        mirrored = n > 2 * COARSEST_SWEEPS - 2
        smooth(xl, bl, w, a, n % 2 if mirrored else 1 - n % 2)
    wrap_ghosts(xl, periodic)
    if down and level < coarsest:
        rl = at_level(r, table, level)
        defect(rl, xl, bl, w, a)
        wrap_ghosts(rl, periodic)
        restrict(
            at_level(b, table, level + 1),
            rl,
            at_level(marks, table, level),
            leaning_at(lean, table, level),
            guests_at(guests, table, level),
            at_level(hosts, table, level),
        )


serial_leg = leg.serial
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
