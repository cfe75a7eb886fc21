"""Dye carried through the faces of whole cells, along one axis at a time.

What a face lets through is the mean of that part of a parabola in the cell upstream that flows over
it: the piecewise parabolic method (Colella and Woodward 1984). A parabola keeps between the values
of the cells beside it, but where second differences agree, so at smooth extrema (Colella and
Sekora 2008), and there between two bounds; so does every value, as long as no more flows out of a
cell than is in it.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from flowborne.kernels.arrays import Array, Marks
from flowborne.kernels.jit import inlined, kernel

WIDTH = 64
"""Lines of cells that one thread goes through side by side."""

ALIKE = 1.25
"""Second differences of a parabola per smallest one around it above which it is not smooth."""

TINY = 1e-300


@inlined
def bend_row(
    low: Array, high: Array, a: Array, b: Array, c: Array, d: Array, e: Array, clear: Array,
    least: float, most: float,
) -> None:  # fmt: skip
    """How much the parabolas in a row of cells rise from their lower sides to the means, `low`, and
    from there to their upper sides, `high`. Written without branches, so that it vectorises.

    a, b, c, d, e  values of the cells in line, the row's own in the middle
    clear          0 where the value is the cell's own everywhere in it
    least, most    bounds where second differences agree
    """
    for k in range(c.size):
        p, q, r, s, t = a[k], b[k], c[k], d[k], e[k]
        below, above = r - q, s - r
        rise, fall = r - (7.0 * (q + r) - p - s) / 12.0, (7.0 * (r + s) - q - t) / 12.0 - r
        up, down = min(max(rise, 0.0), max(below, 0.0)), min(max(-rise, 0.0), max(-below, 0.0))
        on, off = min(max(fall, 0.0), max(above, 0.0)), min(max(-fall, 0.0), max(-above, 0.0))
        first, bend, last = below - (q - p), above - below, (t - s) - above
        agree = max(min(first, bend, last), 0.0) + max(min(-first, -bend, -last), 0.0)
        vertex = (abs(rise) + abs(fall)) / 3.0
        part = ALIKE * agree / max(6.0 * abs(fall - rise), TINY)
        part = min(part, max(most - r, 0.0) / max(-rise, fall, vertex, TINY), 1.0)
        part = min(part, max(r - least, 0.0) / max(rise, -fall, vertex, TINY))
        smooth = below * above <= 0.0 or rise * fall <= 0.0 or part >= 1.0
        held_low, held_high = min(up, 2.0 * on) - min(down, 2.0 * off), min(on, 2.0 * up)
        held_high -= min(off, 2.0 * down)
        low[k] = clear[k] * (part * rise if smooth else held_low)
        high[k] = clear[k] * (part * fall if smooth else held_high)


@inlined
def cross_row(
    out: Array, flow: Array, one: Array, low: Array, high: Array, volume: Array,
    other: Array, other_low: Array, other_high: Array, other_volume: Array,
) -> None:  # fmt: skip
    """Amount that crosses a row of faces, along the axis.

    flow                     volume that crosses
    one, low, high, volume   of the cells before the faces: values, rises of `bend_row`, volumes
    other, ...               of those after
    """
    for k in range(out.size):
        g = flow[k]
        ahead = g > 0.0
        part = abs(g) / max(volume[k] if ahead else other_volume[k], TINY)
        rise, fall = (low[k], high[k]) if ahead else (-other_high[k], -other_low[k])
        mean = fall - 0.5 * part * (rise + fall - (3.0 - 2.0 * part) * (rise - fall))
        out[k] = g * ((one[k] if ahead else other[k]) + mean)


@kernel
def sweep(
    field: Array,
    volume: Array,
    flux: Array,
    clear: Marks,
    ends: Array,
    wraps: bool,
    dt: float,
    least: float,
    most: float,
    crossed: Array,
) -> None:
    """Carry a field along the second of its axes, in place.

    field        (m, n, l) values of the cells
    volume       (m, n, l) of the cells, in place
    flux         (m, n+1, l) volume per time through the faces
    clear        (m, n, l) see `bend_row`
    ends         (2, m, l) values beyond both sides, where the axis does not wrap
    least, most  bounds of all values
    crossed      (2, m, l) amounts through both sides along the axis, added to
    """
    m, n, count = field.shape
    strips = (count + WIDTH - 1) // WIDTH
    for block in prange(m * strips):
        i, start = np.int64(block) // strips, (np.int64(block) % strips) * WIDTH
        w = min(WIDTH, count - start)
        c, v, free = np.empty((n + 4, w)), np.empty((n + 2, w)), np.zeros((n + 2, w))
        for j in range(n):
            for k in range(w):
                c[j + 2, k] = field[i, j, start + k]
                v[j + 1, k] = volume[i, j, start + k]
                free[j + 1, k] = clear[i, j, start + k]
        for k in range(w):
            c[:2, k] = ends[0, i, start + k]
            c[n + 2 :, k] = ends[1, i, start + k]
            if wraps:
                c[0, k], c[1, k] = c[n, k], c[n + 1, k]
                c[n + 2, k], c[n + 3, k] = c[2, k], c[3, k]
            v[0, k], v[n + 1, k] = v[n, k], v[1, k]
        low, high, even = np.zeros((n + 2, w)), np.zeros((n + 2, w)), 0
        for j in range(n + 4):
            row, before, same = c[j], c[max(j - 1, 0), 0], True
            for k in range(w):
                same &= row[k] == before
            even = even + 1 if same else 0
            if j >= 4 and even < 5:  # in the middle of five equal rows parabolas are flat
                n0, n1, n2, n3, at = c[j - 4], c[j - 3], c[j - 2], c[j - 1], j - 3
                bend_row(low[at], high[at], n0, n1, n2, n3, row, free[at], least, most)
        if wraps:
            low[0], high[0], low[n + 1], high[n + 1] = low[n], high[n], low[1], high[1]
        flow, amount = np.empty((2, w)), np.empty((2, w))
        for j in range(n + 1):
            here, past = j % 2, (j + 1) % 2
            for k in range(w):
                flow[here, k] = dt * flux[i, j, start + k]
            cross_row(
                amount[here], flow[here], c[j + 1], low[j], high[j], v[j],
                c[j + 2], low[j + 1], high[j + 1], v[j + 1],
            )  # fmt: skip
            if j > 0:
                for k in range(w):
                    out, lost = flow[here, k] - flow[past, k], amount[here, k] - amount[past, k]
                    left = v[j, k] - out
                    gain = (c[j + 1, k] * out - lost) / (left if left > 0.0 else 1.0)
                    field[i, j - 1, start + k] = min(max(c[j + 1, k] + gain, least), most)
                    volume[i, j - 1, start + k] = left
            if j == 0 or j == n:
                for k in range(w):
                    crossed[min(j, 1), i, start + k] += amount[here, k]
