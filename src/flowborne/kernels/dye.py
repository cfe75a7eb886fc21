"""Dye carried through the faces of cells, along one axis at a time, and in cut cells.

What a face lets through is the mean of that part of a parabola in the cell upstream that flows over
it: the piecewise parabolic method (Colella and Woodward 1984). A parabola keeps between the values
of the cells beside it, but where second differences agree, so at smooth extrema (Colella and
Sekora 2008), and there between two bounds; so does every value, as long as no more flows out of a
cell than is in it.

In a cut cell what is in it leaves first, then what comes in, well mixed. So no cell is too small:
where more flows through it in a step than it holds, it passes on what comes in (implicit upwind
values; May and Berger 2017 join them to an explicit scheme). One that a body leaves takes what
flows in, one that a body takes up gives what it has to where its fluid goes, and nothing passes a
closed face. Lists are of the cut cells, in ascending order; `way` is 2 axis for the lower and
2 axis + 1 for the upper face across an axis.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import prange

from flowborne.kernels.arrays import ROUNDING, Array, Faces, Integers, Marks, Three
from flowborne.kernels.control_volumes import both_beside, indices, stride
from flowborne.kernels.jit import inlined, kernel
from flowborne.kernels.lists import place_of

WIDTH = 64
"""Lines of cells that one thread goes through side by side."""

ALIKE = 1.25
"""Second differences of a parabola per smallest one around it above which it is not smooth."""

TINY = 1e-300

Bounds = tuple[float, float]
"""Least and largest value."""


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
def copy(to: Array, row: Array) -> None:
    """Write a row over another."""
    for k in range(row.size):
        to[k] = row[k]


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


@inlined
def plane_of(box: Array, i: int, order: Three) -> Array:
    """Plane i across the first axis of an order, its rows along the third; Numba's own transpose
    takes two seconds to compile."""
    across, along, line = order
    if across == 0:
        plane = box[i]
    elif across == 1:
        plane = box[:, i]
    else:
        plane = box[:, :, i]
    return plane if along < line else plane.T


@kernel
def sweep(
    fields: tuple[Array, Array],
    flux: Array,
    clear: Marks,
    box: tuple[Three, Three, Three],
    ends: Array,
    wraps: bool,
    dt: float,
    bounds: Bounds,
) -> Array:
    """Carry a field along the second of its axes in an order, in a box and in place; gives the
    amounts through both ends of the box.

    fields  (nx, ny, nz) values of the cells, and their volumes
    flux    volume per time through the faces across the axis
    clear   (nx, ny, nz) see `bend_row`
    box     first cell along each axis, that after the last, and the order of axes, in which it has
            (m, n, l) cells
    ends    (2, m, l) values beyond both sides, where the axis does not wrap
    bounds  of all values
    returns (2, m, l)
    """
    field, volume = fields
    (x, y, z), (x1, y1, z1), order = box
    faces = flux[x : x1 + (order[1] == 0), y : y1 + (order[1] == 1), z : z1 + (order[1] == 2)]
    values, volumes = field[x:x1, y:y1, z:z1], volume[x:x1, y:y1, z:z1]
    cleared, (least, most), crossed = clear[x:x1, y:y1, z:z1], bounds, np.zeros(ends.shape)
    shape = values.shape
    m, n, count = shape[order[0]], shape[order[1]], shape[order[2]]
    strips = (count + WIDTH - 1) // WIDTH
    for block in prange(m * strips):
        i, start = np.int64(block) // strips, (np.int64(block) % strips) * WIDTH
        w, strip = min(WIDTH, count - start), slice(start, start + WIDTH)
        lines, room = plane_of(values, i, order)[:, strip], plane_of(volumes, i, order)[:, strip]
        through, marks = plane_of(faces, i, order)[:, strip], plane_of(cleared, i, order)[:, strip]
        c = np.empty((n + 4, w))
        v, free = np.ones((n + 2, w)), np.empty(w)
        for j in range(n):
            copy(c[j + 2], lines[j])
        for j in range(2):
            copy(c[j], c[n + j] if wraps else ends[0, i, strip])
            copy(c[n + 2 + j], c[2 + j] if wraps else ends[1, i, strip])
        low, high, even = np.zeros((n + 2, w)), np.zeros((n + 2, w)), 0
        steady = np.ones(n + 2, np.bool_)  # nothing but the volume changes between two such rows
        for j in range(n + 4):
            row, before, same = c[j], c[max(j - 1, 0), 0], True
            for k in range(w):
                same &= row[k] == before
            even, at = even + 1 if same else 0, j - 3
            if j >= 4 and even < 5:  # in the middle of five equal rows parabolas are flat
                n0, n1, n2, n3 = c[j - 4], c[j - 3], c[j - 2], c[j - 1]
                copy(free, marks[at - 1])
                bend_row(low[at], high[at], n0, n1, n2, n3, row, free, least, most)
                steady[at] = False
        if wraps:
            for rise in (low, high):
                copy(rise[0], rise[n])
                copy(rise[n + 1], rise[1])
            steady[0], steady[n + 1] = steady[n], steady[1]
        for j in range(n):
            if not (steady[j] and steady[j + 1] and steady[j + 2]):
                copy(v[j + 1], room[j])
        copy(v[0], v[n])
        copy(v[n + 1], v[1])
        flow, amount, calm = np.empty((2, w)), np.empty((2, w)), False
        for j in range(n + 1):
            q, now, was = through[j], flow[j % 2], flow[(j + 1) % 2]
            more, less, old, still = amount[j % 2], amount[(j + 1) % 2], c[j + 1], calm
            calm = steady[j] and steady[j + 1]
            for k in range(w):
                now[k] = dt * q[k]
            if calm:
                for k in range(w):
                    more[k] = now[k] * old[k]
            else:
                cross_row(
                    more, now, old, low[j], high[j], v[j], c[j + 2], low[j + 1], high[j + 1],
                    v[j + 1],
                )  # fmt: skip
            if j > 0 and calm and still:
                held = room[j - 1]
                for k in range(w):
                    held[k] -= now[k] - was[k]
            elif j > 0:
                line, held, before_it = lines[j - 1], room[j - 1], v[j]
                for k in range(w):
                    out, lost = now[k] - was[k], more[k] - less[k]
                    left = before_it[k] - out
                    gain = (old[k] * out - lost) / (left if left > 0.0 else 1.0)
                    line[k] = min(max(old[k] + gain, least), most)
                    held[k] = left
            if j == 0 or j == n:
                copy(crossed[min(j, 1), i, strip], more)
    return crossed


WHOLE, CUT, EMPTY = range(3)
"""What a cell is in a step: nothing but fluid, in part or for some time, or never any."""

SWEEPS = 500
"""Most times that what leaves all cut cells is worked out, one after the other; sooner where only
rounding errors change."""


@kernel
def sort_cells(
    before: Array, after: Array, rate: Array, flux: Faces, whole: float
) -> tuple[Marks, Array]:
    """Kind of each cell (nx, ny, nz), WHOLE, CUT or EMPTY, and of each plane (nx,) the largest part
    of a whole one that leaves it per time. Cells that mouths and sources fill are CUT.

    before, after  volumes at both ends of the step
    rate           volume per time that mouths and sources bring
    flux           volume per time through the faces across each axis
    whole          volume from which a cell is whole
    """
    (n0, n1, n2), (x, y, z) = rate.shape, flux
    kind, fullest = np.empty((n0, n1, n2), np.uint8), np.empty(n0)
    for i in prange(n0):
        most = 0.0
        for j in range(n1):
            for k in range(n2):
                out = max(x[i + 1, j, k], 0.0) + max(-x[i, j, k], 0.0)
                out += max(y[i, j + 1, k], 0.0) + max(-y[i, j, k], 0.0)
                out += max(z[i, j, k + 1], 0.0) + max(-z[i, j, k], 0.0)
                come = max(-x[i + 1, j, k], 0.0) + max(x[i, j, k], 0.0)
                come += max(-y[i, j + 1, k], 0.0) + max(y[i, j, k], 0.0)
                come += max(-z[i, j, k + 1], 0.0) + max(z[i, j, k], 0.0)
                least = min(before[i, j, k], after[i, j, k])
                clear = least >= whole and rate[i, j, k] == 0.0
                held = abs(before[i, j, k]) + abs(after[i, j, k]) + abs(rate[i, j, k])
                nothing = held + out + come == 0.0
                kind[i, j, k] = WHOLE if clear else (EMPTY if nothing else CUT)
                most = max(most, out / max(least, whole) if clear else 0.0)
        fullest[i] = most
    return kind, fullest


class CutCells(NamedTuple):
    """Cut cells and the flow through their faces.

    listed  (n,) flat
    beside  (n, 6) flat index of the cell beside, -1 beyond a side
    row     (n, 6) its place in the list, -1 if it is not there
    out     (n, 6) volume that leaves through each face, per time or in a step
    """

    listed: Integers
    beside: Integers
    row: Integers
    out: Array


@kernel
def face_of(shape: Three | Integers, axis: int, f: int, upper: int) -> int:
    """Flat index of the lower or upper face of cell f among the faces across an axis."""
    i, j, _ = indices(shape, f)
    before = 0 if axis == 0 else (i if axis == 1 else i * shape[1] + j)
    return int(f + (before + upper) * stride(shape, axis))


@kernel
def list_flows(cells: CutCells, axis: int, flux: Array, wraps: Three, shape: Three) -> None:
    """Take the faces of cut cells across an axis out of the fluxes, and write what is beside and
    leaves there.

    flux   volume per time through the faces across the axis; 0 at those of cut cells afterwards
    wraps  (3,) number of cells along each periodic axis, else 0
    shape  (3,) of the cells
    """
    (listed, beside, row, out), through, near = cells, flux.reshape(-1), np.zeros(2, np.int64)
    step, count, ring = stride(shape, axis), shape[axis], wraps[axis]
    for n in range(listed.size):
        at, first = indices(shape, listed[n])[axis], face_of(shape, axis, listed[n], 0)
        both = both_beside(listed[n], at, step, count, ring)
        for upper in range(2):
            way, to = 2 * axis + upper, both[upper]
            beside[n, way] = to
            m = near[upper] = place_of(listed, to, near[upper])
            row[n, way] = m if to >= 0 and m < listed.size and listed[m] == to else -1
            out[n, way] = (2.0 * upper - 1.0) * through[first + upper * step]
    for n in range(listed.size):
        for upper in range(2):
            through[face_of(shape, axis, listed[n], upper)] = 0.0
            to = beside[n, 2 * axis + upper]
            if to >= 0:  # the same face, which a periodic axis has twice
                through[face_of(shape, axis, to, 1 - upper)] = 0.0


@kernel
def pass_on(
    field: Array,
    volume: Array,
    cells: CutCells,
    entering: Array,
    gain: Array,
    brought: Array,
    local: Array,
    bounds: Bounds,
) -> float:
    """Carry a field through the faces of cut cells, in place; gives the amount that came in through
    sides of the domain, mouths and sources.

    volume    (nx, ny, nz) of the cells, in place
    cells     and what leaves them in the step
    entering  (n, 6) value of what comes in through sides of the domain
    gain      (n,) volume that mouths bring with
    brought   (n,) amount
    local     (n,) volume that comes in with the value that is there; negative leaves
    bounds    of all values, which a volume below 0 would break by as little as it is
    """
    (listed, beside, row, out), (least, most) = cells, bounds
    values, volumes = field.reshape(-1), volume.reshape(-1)
    count = listed.size
    came, known = gain.copy(), brought.copy()
    old, mixed, leaving = np.empty(count), np.empty(count), np.empty(count)
    share, was, gained = np.ones(count), np.zeros((count, 6)), 0.0
    for n in range(count):
        own = listed[n]
        old[n] = mixed[n] = leaving[n] = values[own]
        gone = max(-local[n], 0.0)
        for way in range(6):
            gone += max(out[n, way], 0.0)
            arrives = max(-out[n, way], 0.0)
            came[n] += arrives
            if beside[n, way] < 0:
                known[n] += arrives * entering[n, way]
                gained += arrives * entering[n, way]
            elif row[n, way] < 0:
                was[n, way] = values[beside[n, way]]
                known[n] += arrives * was[n, way]
        held = max(volumes[own] + max(local[n], 0.0), 0.0)
        if gone > held and came[n] > 0.0:
            share[n] = held / gone
        gained += brought[n] + max(local[n], 0.0) * old[n]
        volumes[own] += gain[n] + local[n]
        for way in range(6):
            volumes[own] -= out[n, way]
    for sweep in range(SWEEPS):
        change, scale = 0.0, 0.0
        for step in range(count):
            n = step if sweep % 2 == 0 else count - 1 - step
            if came[n] > 0.0:
                total = known[n]
                for way in range(6):
                    if row[n, way] >= 0 and out[n, way] < 0.0:
                        total -= out[n, way] * leaving[row[n, way]]
                mixed[n] = min(max(total / came[n], least), most)
            now = share[n] * old[n] + (1.0 - share[n]) * mixed[n]
            change = max(change, abs(now - leaving[n]))
            scale = max(scale, abs(now))
            leaving[n] = now
        if change <= ROUNDING * scale:
            break
    for n in range(count):
        own = listed[n]
        values[own] = mixed[n]
        if share[n] == 1.0 and volumes[own] > 0.0:
            part = min(came[n] / volumes[own], 1.0)
            values[own] = old[n] + part * (mixed[n] - old[n])
        gained -= max(-local[n], 0.0) * leaving[n]
        for way in range(6):
            if beside[n, way] < 0:
                gained -= max(out[n, way], 0.0) * leaving[n]
            elif row[n, way] < 0:
                volumes[beside[n, way]] += out[n, way]
    for n in range(count):
        for way in range(6):
            if beside[n, way] >= 0 and row[n, way] < 0 and out[n, way] > 0.0:
                to = beside[n, way]
                values[to] += out[n, way] * (leaving[n] - was[n, way]) / volumes[to]
    return gained
