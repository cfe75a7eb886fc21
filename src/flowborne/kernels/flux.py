"""What flows out of every control volume of a field that is carried along: flux form.

Arrays are padded by GHOSTS layers along every axis that fluid moves along. A slab is a room one
layer thick along its first axis, which nothing moves along.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import prange

from flowborne.kernels.arrays import Array, Faces, Integers, Marks, Three
from flowborne.kernels.jit import inlined, kernel

GHOSTS = 2
"""Layers of ghosts: what a value of third order needs."""

ROOM = 0.5
"""Room of a value beyond its two neighbours where the field is smooth, in second differences: a
parabola needs 1/8 between the samples beside its vertex, a third-order value 1/6."""

SIXTH = 1.0 / 6.0

CUT, CLEAR, UPSTREAM = range(3)
"""What may be used at the sides of a control volume: means with those beside it, values of third
order, or what is upstream."""

PLANES = 8
"""Planes that one thread goes through at a time: what leaves one comes into the next."""


class Fluxes(NamedTuple):
    """What flows through the sides of the control volumes of one component.

    through    volume per time through the faces of the cells across each axis
    component  axis of the kernel
    place      (2, n + 1, 2) of which two faces' fluxes those through the sides are means: across
               other axes, and across the component's own
    share      (2, n + 1, 2) how much of each
    """

    through: Faces
    component: int
    place: Integers
    share: Array


class Stage(NamedTuple):
    """A stage of a step: (before start - dt net) / after in each control volume.

    later    the component after it; where the volume is not above `nothing`, what is left of the
             amount in place of the value
    kept     before start - dt net / 2: set by a stage of weight 1, used by one of 1/2
    volume   after it
    weight   of what leaves in it
    dt       s
    nothing  volume up to which a control volume holds nothing
    """

    later: Array
    kept: Array
    volume: Array
    weight: float
    dt: float
    nothing: float


class Padded(NamedTuple):
    """The component that is carried along with its ghosts, and which values may be used: CUT, CLEAR
    or UPSTREAM."""

    values: Array
    marks: Marks


@inlined
def in_line(now: Stage) -> Stage:
    """The same with flat arrays."""
    later, kept, volume = now.later.reshape(-1), now.kept.reshape(-1), now.volume.reshape(-1)
    return Stage(later, kept, volume, now.weight, now.dt, now.nothing)


@inlined
def side_flux(
    g: float, line: tuple[float, float, float, float], here: np.uint8, there: np.uint8
) -> float:
    """Flux x value at a side, for the values behind, below, above and ahead of it.

    The upwind value of third order (Leonard 1979), the mean of both less a sixth of the second
    difference upstream, lies between both, but for smooth extrema, where second differences on both
    sides agree. It is taken where both marks are CLEAR, what is upstream where one is UPSTREAM,
    else the mean. Written without branches, so that it vectorises.
    """
    behind, low, high, ahead = line
    jump, mean = high - low, 0.5 * (low + high)
    low_bend, high_bend = jump - (low - behind), (ahead - high) - jump
    room = max(min(low_bend, high_bend), 0.0) - min(max(low_bend, high_bend), 0.0)
    most = 0.5 * abs(jump) + ROOM * room
    bend = SIXTH * (low_bend if g > 0.0 else high_bend)
    either = mean
    if here | there >= UPSTREAM:
        either = low if g > 0.0 else high
    return g * (mean - min(max(bend, -most), most) if here & there == CLEAR else either)


@inlined
def side_row(
    out: Array, count: int, i: int, j: int, across: tuple[int, int], q: Array, shape: Three,
    place: Integers, share: Array, component: int, field: Array, marks: Marks,
) -> None:  # fmt: skip
    """Flux x value through `count` sides of the control volumes (i, j, :) of a component.

    Places are unsigned, and there is one loop: else it is not vectorised.

    across        where the row above the sides begins in the padded field, and what is between
                  neighbours across them
    q             through the faces of the cells, across the axis of the sides; flat, of this shape
    place, share  (n, 2) which two of them along the component's axis, and how much of each
    """
    n1, n2, zero, one = np.uintp(shape[1]), np.uintp(shape[2]), np.uintp(0), np.uintp(1)
    (at, step), line = across, i if component == 0 else (j if component == 1 else one)
    first, second, s, t = place[line, 0], place[line, 1], share[line, 0], share[line, 1]
    row, ends = (i * n1 + j) * n2, zero
    if component == 0:
        low, high = (np.uintp(first) * n1 + j) * n2, (np.uintp(second) * n1 + j) * n2
    elif component == 1:
        low, high = (i * n1 + np.uintp(first)) * n2, (i * n1 + np.uintp(second)) * n2
    else:
        low, high, ends = row - one, row, one
    for k in range(ends, count - ends):
        n, g = at + k, s * q[low + k] + t * q[high + k]
        four = field[n - step - step], field[n - step], field[n], field[n + step]
        out[k] = side_flux(g, four, marks[n - step], marks[n])
    for end in range(ends + ends):
        last = (count - one) * end
        m, one_face, other_face = at + last, np.uintp(place[last, 0]), np.uintp(place[last, 1])
        g = share[last, 0] * q[row + one_face] + share[last, 1] * q[row + other_face]
        four = field[m - step - step], field[m - step], field[m], field[m + step]
        out[last] = side_flux(g, four, marks[m - step], marks[m])


@kernel
def stage(now: Stage, start: Array, before: Array, padded: Padded, flux: Fluxes) -> None:
    """A component after a stage.

    start, before  the component and the volumes at the start
    """
    q, component, place, share = flux
    qx, qy, qz = q[0].reshape(-1), q[1].reshape(-1), q[2].reshape(-1)
    n0, n1, n2 = np.uintp(start.shape[0]), np.uintp(start.shape[1]), np.uintp(start.shape[2])
    field, values, mark = padded.values, padded.values.reshape(-1), padded.marks.reshape(-1)
    (later, kept, high, weight, _, nothing), half = in_line(now), 0.5 * now.dt
    first, low, room = start.reshape(-1), before.reshape(-1), field.shape[0] > start.shape[0]
    zero, one, deep, planes = np.uintp(0), np.uintp(1), np.uintp(GHOSTS), np.uintp(PLANES)
    p = deep if room else zero
    rows, wide = np.uintp(field.shape[1]), np.uintp(field.shape[2])
    for block in prange((start.shape[0] + PLANES - 1) // PLANES):
        bottom = np.uintp(block) * planes
        side, row, net = np.empty(n2 + one), np.empty(n2), np.empty(n2)
        below = np.empty(n1 * n2)
        carried = component, values, mark
        x = qx, q[0].shape, place[int(component == 0)], share[int(component == 0)]
        y = qy, q[1].shape, place[int(component == 1)], share[int(component == 1)]
        z = qz, q[2].shape, place[int(component == 2)], share[int(component == 2)]
        for i in range(bottom, min(bottom + planes, n0)):
            at = ((i + p) * rows + deep) * wide + deep
            side_row(row, n2, i, zero, (at, wide), *y, *carried)
            for j in range(n1):
                at, n, m = ((i + p) * rows + j + deep) * wide + deep, (i * n1 + j) * n2, j * n2
                side_row(side, n2 + one, i, j, (at, one), *z, *carried)
                for k in range(n2):
                    net[k] = side[k + one] - side[k] - row[k]
                side_row(row, n2, i, j + one, (at + wide, wide), *y, *carried)
                for k in range(n2):
                    net[k] += row[k]
                if room:
                    if i == bottom:
                        side_row(side, n2, i, j, (at, rows * wide), *x, *carried)
                        for k in range(n2):
                            below[m + k] = side[k]
                    above = at + rows * wide, rows * wide
                    side_row(side, n2, i + one, j, above, *x, *carried)
                    for k in range(n2):
                        net[k] += side[k] - below[m + k]
                        below[m + k] = side[k]
                if weight == 1.0:
                    for k in range(n2):
                        kept[n + k] = low[n + k] * first[n + k] - half * net[k]
                for k in range(n2):
                    volume = high[n + k]
                    left = kept[n + k] - half * net[k]
                    later[n + k] = left / (volume if volume > nothing else 1.0)


@kernel
def pad_field(out: Array, values: Array, along: Array, time: float) -> None:
    """values + time along into the inside of an array padded by GHOSTS."""
    p = GHOSTS if out.shape[0] > values.shape[0] else 0
    n2 = values.shape[2]
    for i in prange(values.shape[0]):
        for j in range(values.shape[1]):
            inner, one, other = out[i + p, j + GHOSTS, GHOSTS:-GHOSTS], values[i, j], along[i, j]
            for k in range(n2):
                inner[k] = one[k] + time * other[k]


@kernel
def largest_crossing(qx: Array, qy: Array, qz: Array) -> float:
    """Largest volume per time that crosses a cell, the axes added up."""
    (n0, n1), room = qy.shape[:2], qx.shape[2] > 1
    x, y, z = qx, qy, qz
    if not room:  # a slab's rows along y
        x = y = qx.reshape((1, n0 + 1, qx.shape[1]))
        z = qy.reshape((1, n0, n1))
    most = np.zeros(z.shape[0])
    for i in prange(z.shape[0]):
        row = np.zeros(y.shape[2])
        for j in range(z.shape[1]):
            for k in range(row.size):
                rate = max(abs(x[i, j, k]), abs(x[i + 1, j, k])) if room else 0.0
                rate += max(abs(y[i, j, k]), abs(y[i, j + 1, k]))
                rate += max(abs(z[i, j, k]), abs(z[i, j, k + 1]))
                row[k] = max(row[k], rate)
        most[i] = row.max()
    return float(most.max())
