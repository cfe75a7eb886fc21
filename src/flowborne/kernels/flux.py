"""What flows out of every control volume of a field that is carried along: flux form.

Arrays are padded by GHOSTS layers along every axis that fluid moves along. A slab is a room one
layer thick along its first axis, which nothing moves along.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from flowborne.kernels.arrays import Array, Faces, Integers, Marks
from flowborne.kernels.jit import kernel

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

inlined = njit(forceinline=True, nogil=True, cache=True)


@inlined
def line_flux(
    out: Array, flux: Array, a: Array, b: Array, c: Array, d: Array, one: Marks, other: Marks
) -> None:
    """Flux x value between b and c, of a, b, c, d in line, for a row of sides.

    The upwind value of third order (Leonard 1979) lies between b and c, but for smooth extrema,
    where second differences on both sides agree. Written without branches, so that it vectorises.

    one, other  marks of b and c: of third order where both are CLEAR, what is upstream where one is
                UPSTREAM, else the mean of both
    """
    for k in range(out.size):
        g, p, q, r, s = flux[k], a[k], b[k], c[k], d[k]
        low_bend, high_bend = p - 2.0 * q + r, q - 2.0 * r + s
        room = max(min(low_bend, high_bend), 0.0) + max(min(-low_bend, -high_bend), 0.0)
        low, high = min(q, r) - ROOM * room, max(q, r) + ROOM * room
        value = (5.0 * q + 2.0 * r - p if g > 0.0 else 5.0 * r + 2.0 * q - s) / 6.0
        value = min(max(value, low), high)
        upstream = q if g > 0.0 else r
        either = upstream if one[k] | other[k] >= UPSTREAM else 0.5 * (q + r)
        out[k] = g * (value if one[k] & other[k] == CLEAR else either)


@inlined
def side_row(
    out: Array, q: Array, component: int, i: int, j: int, place: Integers, share: Array
) -> None:
    """Volume per time through a row of sides of the control volumes of a component: means of what
    flows through the faces of both their cells.

    q             through the faces of the cells, across the axis of the sides
    place, share  (n, 2) which two of them along the component's axis, and how much of each
    """
    if component == 2:
        line, last = q[i, j], out.size - 1
        mean_row(out[1:last], line[: last - 1], line[1:last], 0.5, 0.5)
        out[0] = share[0, 0] * line[place[0, 0]] + share[0, 1] * line[place[0, 1]]
        out[last] = share[last, 0] * line[place[last, 0]] + share[last, 1] * line[place[last, 1]]
    elif component == 1:
        mean_row(out, q[i, place[j, 0]], q[i, place[j, 1]], share[j, 0], share[j, 1])
    else:
        mean_row(out, q[place[i, 0], j], q[place[i, 1], j], share[i, 0], share[i, 1])


@inlined
def mean_row(out: Array, one: Array, other: Array, first: float, second: float) -> None:
    """out = first one + second other."""
    for k in range(out.size):
        out[k] = first * one[k] + second * other[k]


@inlined
def advance(
    out: Array,
    net: Array,
    above: Array,
    leaving: Array,
    weight: float,
    start: Array,
    before: Array,
    after: Array,
    dt: float,
    nothing: float,
) -> None:
    """A row of `stage`, of what leaves through the sides above and through all others."""
    if weight < 1.0:
        for k in range(out.size):
            net[k] = weight * (leaving[k] + above[k]) + (1.0 - weight) * net[k]
    else:
        for k in range(out.size):
            net[k] = leaving[k] + above[k]
    for k in range(out.size):
        amount = before[k] * start[k] - dt * net[k]
        out[k] = amount / (after[k] if after[k] > nothing else 1.0)


@kernel
def stage(
    out: Array,
    net: Array,
    weight: float,
    start: Array,
    before: Array,
    after: Array,
    dt: float,
    nothing: float,
    field: Array,
    marks: Marks,
    q: Faces,
    component: int,
    place: Integers,
    share: Array,
) -> None:
    """A component after a stage: (before start - dt net) / after in each of its control volumes.

    out            (n0, n1, n2); where the volume after is not above `nothing`, what is left of the
                   amount is given in place of the value
    net            net amount that leaves each control volume per time, of earlier stages with
                   weight 1 - `weight`; after it of this one as well
    start          the component at the start
    before, after  volumes at both ends
    field          the component that is carried along, padded
    marks          padded: CUT, CLEAR or UPSTREAM
    q              volume per time through the faces of the cells across each axis
    place, share   (2, n + 1, 2) see `side_row`: across other axes, and across the component's own
    """
    qx, qy, qz = q
    n0, n1, n2 = out.shape
    p = GHOSTS if field.shape[0] > n0 else 0
    for block in prange((n0 + PLANES - 1) // PLANES):
        first = np.int64(block) * PLANES
        side, row, below = np.empty(n2 + 1), np.empty(n2), np.empty((n1, n2))
        along, across, leaving = np.empty(n2 + 1), np.empty(n2), np.empty(n2)
        x_place, x_share = place[int(component == 0)], share[int(component == 0)]
        y_place, y_share = place[int(component == 1)], share[int(component == 1)]
        z_place, z_share = place[int(component == 2)], share[int(component == 2)]
        for i in range(first, min(first + PLANES, n0)):
            x = i + p
            for j in range(n1 + 1):
                y = j + GHOSTS
                f, m = field[x], marks[x]
                side_row(across, qy, component, i, j, y_place, y_share)
                line_flux(
                    row, across, f[y - 2, 2:-2], f[y - 1, 2:-2], f[y, 2:-2], f[y + 1, 2:-2],
                    m[y - 1, 2:-2], m[y, 2:-2],
                )  # fmt: skip
                if j > 0:
                    advance(
                        out[i, j - 1], net[i, j - 1], row, leaving, weight, start[i, j - 1],
                        before[i, j - 1], after[i, j - 1], dt, nothing,
                    )  # fmt: skip
                if j == n1:
                    break
                f, m = field[x, y], marks[x, y]
                side_row(along, qz, component, i, j, z_place, z_share)
                line_flux(side, along, f[:-3], f[1:-2], f[2:-1], f[3:], m[1:-2], m[2:-1])
                for k in range(n2):
                    leaving[k] = side[k + 1] - side[k] - row[k]
                if p == 0:
                    continue
                for z in range(x if i == first else x + 1, x + 2):
                    side_row(across, qx, component, z - p, j, x_place, x_share)
                    line_flux(
                        row, across, field[z - 2, y, 2:-2], field[z - 1, y, 2:-2],
                        field[z, y, 2:-2], field[z + 1, y, 2:-2], marks[z - 1, y, 2:-2],
                        marks[z, y, 2:-2],
                    )  # fmt: skip
                    if z == x:
                        below[j] = row
                for k in range(n2):
                    leaving[k] += row[k] - below[j, k]
                    below[j, k] = row[k]


def side_fluxes_reference(flux: Faces, component: int, place: Integers, share: Array) -> Faces:
    """`side_row` in NumPy: through all sides across each axis."""
    through = []
    for axis, q in enumerate(flux):
        own = int(axis == component)
        count = q.shape[component] + 1
        at, part = place[own, :count], share[own, :count]
        q = np.moveaxis(q, component, -1)
        mean = part[:, 0] * q[..., at[:, 0]] + part[:, 1] * q[..., at[:, 1]]
        through.append(np.ascontiguousarray(np.moveaxis(mean, -1, component)))
    return through[0], through[1], through[2]


def line_flux_reference(
    flux: Array, a: Array, b: Array, c: Array, d: Array, one: Marks, other: Marks
) -> Array:
    """`line_flux` in NumPy."""
    forward = flux > 0.0
    behind, upstream, downstream, ahead = np.where(forward, (a, b, c, d), (d, c, b, a))
    bends = np.stack([behind - 2.0 * upstream + downstream, upstream - 2.0 * downstream + ahead])
    room = np.where(bends.prod(axis=0) > 0.0, ROOM * np.abs(bends).min(axis=0), 0.0)
    low, high = np.minimum(upstream, downstream) - room, np.maximum(upstream, downstream) + room
    smooth = np.clip((5.0 * upstream + 2.0 * downstream - behind) / 6.0, low, high)
    either = np.where(np.maximum(one, other) == UPSTREAM, upstream, 0.5 * (b + c))
    return np.asarray(flux * np.where((one == CLEAR) & (other == CLEAR), smooth, either))


def net_flux_reference(field: Array, marks: Marks, gx: Array, gy: Array, gz: Array) -> Array:
    """`net_flux` in NumPy, of the fluxes through the sides of the control volumes."""
    shape = gz.shape[0], gz.shape[1], gz.shape[2] - 1
    inner = [
        slice(GHOSTS, -GHOSTS) if n < m else slice(None)
        for n, m in zip(shape, field.shape, strict=True)
    ]
    net = np.zeros(shape)
    for axis, flux in enumerate((gx, gy, gz)):
        if field.shape[axis] == shape[axis]:
            continue
        along = list(inner)
        along[axis] = slice(None)
        f = np.moveaxis(field[tuple(along)], axis, 0)
        m = np.moveaxis(marks[tuple(along)], axis, 0)
        through = line_flux_reference(
            np.moveaxis(flux, axis, 0), f[:-3], f[1:-2], f[2:-1], f[3:], m[1:-2], m[2:-1]
        )
        net += np.diff(np.moveaxis(through, 0, axis), axis=axis)
    return net


def stage_reference(
    net: Array,
    weight: float,
    start: Array,
    before: Array,
    after: Array,
    dt: float,
    nothing: float,
    field: Array,
    marks: Marks,
    q: Faces,
    component: int,
    place: Integers,
    share: Array,
) -> tuple[Array, Array]:
    """`stage` in NumPy: the component after it, and the net amount."""
    through = side_fluxes_reference(q, component, place, share)
    leaving = weight * net_flux_reference(field, marks, *through)
    net = leaving + ((1.0 - weight) * net if weight < 1.0 else 0.0)
    amount = before * start - dt * net
    return amount / np.where(after > nothing, after, 1.0), net


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
    n0, n1, n2 = qy.shape[0], qx.shape[1], qx.shape[2]
    most = np.zeros(n0)
    for i in prange(n0):
        for j in range(n1):
            for k in range(n2):
                rate = max(abs(qx[i, j, k]), abs(qx[i + 1, j, k]))
                rate += max(abs(qy[i, j, k]), abs(qy[i, j + 1, k]))
                rate += max(abs(qz[i, j, k]), abs(qz[i, j, k + 1]))
                most[i] = max(most[i], rate)
    return float(most.max())


def largest_crossing_reference(q: Faces) -> float:
    """`largest_crossing` in NumPy."""
    rates = []
    for axis, flux in enumerate(q):
        size = np.moveaxis(np.abs(flux), axis, 0)
        rates.append(np.moveaxis(np.maximum(size[:-1], size[1:]), 0, axis))
    return float(sum(rates).max())
