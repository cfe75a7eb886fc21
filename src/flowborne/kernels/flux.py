"""What flows out of every control volume of a field that is carried along: flux form.

Arrays are padded by GHOSTS layers along every axis that fluid moves along. A slab is a room one
layer thick along its first axis, which nothing moves along.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from flowborne.kernels.jit import kernel

Array = NDArray[np.float64]
Marks = NDArray[np.uint8]

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


@kernel
def net_flux(out: Array, field: Array, marks: Marks, gx: Array, gy: Array, gz: Array) -> None:
    """Net amount of a field that leaves each control volume per time.

    out         (n0, n1, n2)
    field       the field, padded
    marks       padded: CUT, CLEAR or UPSTREAM
    gx, gy, gz  volume per time through the sides across each axis, one more than `out` along it
    """
    n0, n1, n2 = out.shape
    p = GHOSTS if field.shape[0] > n0 else 0
    for block in prange((n0 + PLANES - 1) // PLANES):
        first = np.int64(block) * PLANES
        side, row, below = np.empty(n2 + 1), np.empty(n2), np.empty((n1, n2))
        for i in range(first, min(first + PLANES, n0)):
            x = i + p
            for j in range(n1 + 1):
                y = j + GHOSTS
                f, m = field[x], marks[x]
                line_flux(
                    row, gy[i, j], f[y - 2, 2:-2], f[y - 1, 2:-2], f[y, 2:-2], f[y + 1, 2:-2],
                    m[y - 1, 2:-2], m[y, 2:-2],
                )  # fmt: skip
                if j > 0:
                    for k in range(n2):
                        out[i, j - 1, k] += row[k]
                if j == n1:
                    break
                f, m = field[x, y], marks[x, y]
                line_flux(side, gz[i, j], f[:-3], f[1:-2], f[2:-1], f[3:], m[1:-2], m[2:-1])
                for k in range(n2):
                    out[i, j, k] = side[k + 1] - side[k] - row[k]
                if p == 0:
                    continue
                for q in range(x if i == first else x + 1, x + 2):
                    line_flux(
                        row, gx[q - p, j], field[q - 2, y, 2:-2], field[q - 1, y, 2:-2],
                        field[q, y, 2:-2], field[q + 1, y, 2:-2], marks[q - 1, y, 2:-2],
                        marks[q, y, 2:-2],
                    )  # fmt: skip
                    if q == x:
                        below[j] = row
                for k in range(n2):
                    out[i, j, k] += row[k] - below[j, k]
                    below[j, k] = row[k]


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
    """`net_flux` in NumPy."""
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


@kernel
def advance(
    out: Array, field: Array, before: Array, net: Array, dt: float, after: Array, nothing: float
) -> None:
    """Value of every control volume after a step: (before field - dt net) / after.

    before, after  volumes at both ends; where the volume after is not above `nothing`, what is left
                   of the amount is given in place of the value
    """
    for i in prange(out.shape[0]):
        for j in range(out.shape[1]):
            for k in range(out.shape[2]):
                amount = before[i, j, k] * field[i, j, k] - dt * net[i, j, k]
                volume = after[i, j, k]
                out[i, j, k] = amount / (volume if volume > nothing else 1.0)


def advance_reference(
    field: Array, before: Array, net: Array, dt: float, after: Array, nothing: float
) -> Array:
    """`advance` in NumPy."""
    return np.asarray((before * field - dt * net) / np.where(after > nothing, after, 1.0))
