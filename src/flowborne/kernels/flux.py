"""What flows out of every control volume of a field that is carried along: flux form.

Arrays are padded by GHOSTS layers along every axis that fluid moves along. A slab is a room one
layer thick along its first axis, which nothing moves along.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import prange

from flowborne.kernels.arrays import Array, Faces, Integers, Marks
from flowborne.kernels.jit import inlined, kernel

GHOSTS = 2
"""Layers of ghosts: what a value of third order needs."""

ROOM = 0.5
"""Room of a value beyond its two neighbours where the field is smooth, in second differences: a
parabola needs 1/8 between the samples beside its vertex, a third-order value 1/6."""

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
    net      net amount that leaves each control volume per time: given by a stage of weight 1,
             taken with 1 - `weight` by one of less
    volume   after it
    weight   of what leaves in it
    dt       s
    nothing  volume up to which a control volume holds nothing
    """

    later: Array
    net: Array
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
    later, net, volume = now.later.reshape(-1), now.net.reshape(-1), now.volume.reshape(-1)
    return Stage(later, net, volume, now.weight, now.dt, now.nothing)


@inlined
def line_flux(
    out: Array,
    span: tuple[int, int],
    q: Array,
    rows: tuple[int, int],
    share: Array,
    field: Array,
    marks: Marks,
    across: tuple[int, int],
) -> None:
    """Flux x value at a row of sides, from the first to the end of `span`, all arrays flat.

    What flows through each side is the mean of what flows through the faces of two cells. The
    upwind value of third order (Leonard 1979) lies between both neighbours, but for smooth extrema,
    where second differences on both sides agree; it is taken where both are CLEAR, what is upstream
    where one is UPSTREAM, else the mean of both. Written without branches and views, and with
    unsigned places, so that it vectorises.

    rows    where in q the two rows of faces begin; share (2,) how much of each
    across  where the row above the sides begins in the padded field, and what is between neighbours
            across them
    """
    (one, other), (at, step), s, t = rows, across, share[0], share[1]
    for k in range(span[0], span[1]):
        g = s * q[one + k] + t * q[other + k]
        n = at + k
        low, high = field[n - step], field[n]
        ahead, behind = field[n + step], field[n - step - step]
        low_bend, high_bend = behind - 2.0 * low + high, low - 2.0 * high + ahead
        room = max(min(low_bend, high_bend), 0.0) + max(min(-low_bend, -high_bend), 0.0)
        least, most = min(low, high) - ROOM * room, max(low, high) + ROOM * room
        forward = 5.0 * low + 2.0 * high - behind
        value = (forward if g > 0.0 else 5.0 * high + 2.0 * low - ahead) / 6.0
        value = min(max(value, least), most)
        upstream = low if g > 0.0 else high
        here, there = marks[n - step], marks[n]
        either = upstream if here | there >= UPSTREAM else 0.5 * (low + high)
        out[k] = g * (value if here & there == CLEAR else either)


@inlined
def side_row(
    out: Array,
    count: int,
    q: Array,
    shape: tuple[int, int, int],
    i: int,
    j: int,
    component: int,
    place: Integers,
    share: Array,
    field: Array,
    marks: Marks,
    across: tuple[int, int],
) -> None:
    """Flux x value through `count` sides of the control volumes (i, j, :) of a component.

    q             through the faces of the cells, across the axis of the sides; flat, of this shape
    place, share  (n, 2) which two of them along the component's axis, and how much of each
    """
    n1, n2, zero, one = np.uintp(shape[1]), np.uintp(shape[2]), np.uintp(0), np.uintp(1)
    if component == 0:
        low, high = np.uintp(place[i, 0]), np.uintp(place[i, 1])
        rows = (low * n1 + j) * n2, (high * n1 + j) * n2
        line_flux(out, (zero, count), q, rows, share[i], field, marks, across)
    elif component == 1:
        low, high = np.uintp(place[j, 0]), np.uintp(place[j, 1])
        rows = (i * n1 + low) * n2, (i * n1 + high) * n2
        line_flux(out, (zero, count), q, rows, share[j], field, marks, across)
    else:
        row = (i * n1 + j) * n2
        rows = row - one, row
        line_flux(out, (one, count - one), q, rows, share[1], field, marks, across)
        for k in (zero, count - one):
            rows = row + np.uintp(place[k, 0]) - k, row + np.uintp(place[k, 1]) - k
            line_flux(out, (k, k + one), q, rows, share[k], field, marks, across)


@kernel
def stage(now: Stage, start: Array, before: Array, padded: Padded, flux: Fluxes) -> None:
    """A component after a stage.

    start, before  the component and the volumes at the start
    """
    q, component, place, share = flux
    qx, qy, qz = q[0].reshape(-1), q[1].reshape(-1), q[2].reshape(-1)
    out, weight, dt, nothing = now.later, now.weight, now.dt, now.nothing
    n0, n1, n2 = np.uintp(out.shape[0]), np.uintp(out.shape[1]), np.uintp(out.shape[2])
    field, values, mark = padded.values, padded.values.reshape(-1), padded.marks.reshape(-1)
    later, leaving, high = out.reshape(-1), now.net.reshape(-1), now.volume.reshape(-1)
    first, low = start.reshape(-1), before.reshape(-1)
    zero, one, deep = np.uintp(0), np.uintp(1), np.uintp(GHOSTS)
    room = field.shape[0] > out.shape[0]
    p = deep if room else zero
    rows, wide = np.uintp(field.shape[1]), np.uintp(field.shape[2])
    earlier, alone = 1.0 - weight, weight == 1.0
    planes = np.uintp(PLANES)
    for block in prange((out.shape[0] + PLANES - 1) // PLANES):
        bottom = np.uintp(block) * planes
        side, row = np.empty(out.shape[2] + 1), np.empty(out.shape[2])
        sums, below = np.empty(out.shape[2]), np.empty(out.shape[1] * out.shape[2])
        x_place, x_share = place[int(component == 0)], share[int(component == 0)]
        y_place, y_share = place[int(component == 1)], share[int(component == 1)]
        z_place, z_share = place[int(component == 2)], share[int(component == 2)]
        for i in range(bottom, min(bottom + planes, n0)):
            for j in range(n1 + one):
                at = ((i + p) * rows + j + deep) * wide + deep
                side_row(
                    row, n2, qy, q[1].shape, i, j, component, y_place, y_share, values, mark,
                    (at, wide),
                )  # fmt: skip
                if j > zero:
                    n = (i * n1 + j - one) * n2
                    for k in range(n2):
                        sums[k] += row[k]
                    if alone:
                        for k in range(n2):
                            leaving[n + k] = sums[k]
                    else:
                        for k in range(n2):
                            sums[k] = weight * sums[k] + earlier * leaving[n + k]
                    for k in range(n2):
                        volume = high[n + k]
                        amount = low[n + k] * first[n + k] - dt * sums[k]
                        later[n + k] = amount / (volume if volume > nothing else 1.0)
                if j == n1:
                    break
                side_row(
                    side, n2 + one, qz, q[2].shape, i, j, component, z_place, z_share, values,
                    mark, (at, one),
                )  # fmt: skip
                for k in range(n2):
                    sums[k] = side[k + one] - side[k] - row[k]
                if not room:
                    continue
                n = j * n2
                if i == bottom:
                    side_row(
                        row, n2, qx, q[0].shape, i, j, component, x_place, x_share, values, mark,
                        (at, rows * wide),
                    )  # fmt: skip
                    for k in range(n2):
                        below[n + k] = row[k]
                side_row(
                    row, n2, qx, q[0].shape, i + one, j, component, x_place, x_share, values, mark,
                    (at + rows * wide, rows * wide),
                )  # fmt: skip
                for k in range(n2):
                    sums[k] += row[k] - below[n + k]
                    below[n + k] = row[k]


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
