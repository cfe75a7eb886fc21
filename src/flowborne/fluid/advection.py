"""Advection along particle paths: semi-Lagrangian, and MacCormack with a limiter.

A particle that arrives at x after dt left x_d, with  x_d = x - dt c(x_d)  for the velocity c that
it has half-way; the particle that leaves x arrives at x + dt c(x). MacCormack carries the field
forward and back again and removes half of what that changed (Selle, Fedkiw, Kim, Liu and
Rossignac 2008). Positions are in cells from the domain's lower corner; fields carry one layer of
ghosts (see `ghosts`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flowborne.fluid.grid import Array, Faces
from flowborne.kernels.jit import kernel, njit, prange

Mask = NDArray[np.uint8]

inlined = njit(forceinline=True, nogil=True, cache=True)
"""For what is called at every face: inlined by LLVM, which compiles far sooner than by Numba."""

SMOOTH = 0.25
"""Room of a velocity to exceed its samples, in second differences on each axis: twice what a
parabola does between the samples on both sides of its vertex."""

FEW = 1e-3
"""Least weight of valid samples for which they alone are used."""


@inlined
def sample(field: Array, x: float, y: float, z: float) -> float:
    """Trilinear interpolation of a padded field at padded indices inside it; bilinear in a slab."""
    i, j = int(x), int(y)
    a, b = x - i, y - j
    if field.shape[2] <= 2:
        low = field[i, j, 0] + b * (field[i, j + 1, 0] - field[i, j, 0])
        high = field[i + 1, j, 0] + b * (field[i + 1, j + 1, 0] - field[i + 1, j, 0])
        return float(low + a * (high - low))
    k = int(z)
    c = z - k
    value = 0.0
    for m in range(2):
        wa = a if m else 1.0 - a
        near = field[i + m, j, k] + c * (field[i + m, j, k + 1] - field[i + m, j, k])
        far = field[i + m, j + 1, k] + c * (field[i + m, j + 1, k + 1] - field[i + m, j + 1, k])
        value += wa * (near + b * (far - near))
    return float(value)


@inlined
def all_valid(valid: Mask, x: float, y: float, z: float) -> bool:
    """Whether all samples that an interpolation at padded indices uses are valid."""
    i, j = int(x), int(y)
    if field_is_flat(valid):
        return bool(
            valid[i, j, 0] & valid[i + 1, j, 0] & valid[i, j + 1, 0] & valid[i + 1, j + 1, 0]
        )
    k = int(z)
    whole = valid[i, j, k]
    for m in range(2):
        for n in range(2):
            whole &= valid[i + m, j + n, k] & valid[i + m, j + n, k + 1]
    return bool(whole)


@inlined
def field_is_flat(field: Array) -> bool:
    """Whether a padded field belongs to a slab."""
    return field.shape[2] <= 2


@inlined
def sample_valid(field: Array, valid: Mask, x: float, y: float, z: float) -> float:
    """Interpolation by the valid samples alone.

    Where none is valid, all are used: they hold values continued from the valid ones.
    """
    plain = sample(field, x, y, z)
    if all_valid(valid, x, y, z):
        return plain
    i, j = int(x), int(y)
    a, b = x - i, y - j
    layers, k, c = 1, 0, 0.0
    if not field_is_flat(field):
        layers, k = 2, int(z)
        c = z - k
    total, weights = 0.0, 0.0
    for m in range(2):
        for n in range(2):
            for p in range(layers):
                if valid[i + m, j + n, k + p]:
                    w = (a if m else 1.0 - a) * (b if n else 1.0 - b) * (c if p else 1.0 - c)
                    total += w * field[i + m, j + n, k + p]
                    weights += w
    return total / weights if weights > FEW else plain


@inlined
def wrap(x: float, count: int, periodic: bool) -> float:
    """Position back inside the domain: around where periodic, else to its side (NaN: to 0)."""
    if periodic:
        x -= count * np.floor(x / count)
    if not x >= 0.0:
        return 0.0
    return x if x < count else float(count)


@inlined
def carrier_at(
    cx: Array, cy: Array, cz: Array, x: float, y: float, z: float, flat: bool
) -> tuple[float, float, float]:
    """Carrying velocity at a position, cells per step."""
    u = sample(cx, x + 1.0, y + 0.5, z + 0.5)
    v = sample(cy, x + 0.5, y + 1.0, z + 0.5)
    w = 0.0 if flat else sample(cz, x + 0.5, y + 0.5, z + 1.0)
    return u, v, w


@inlined
def departure(
    cx: Array,
    cy: Array,
    cz: Array,
    x: float,
    y: float,
    z: float,
    counts: NDArray[np.int64],
    periodic: Mask,
    flat: bool,
) -> tuple[float, float, float, float, float, float]:
    """Where the particle that arrives at (x, y, z) came from, and the velocity at (x, y, z)."""
    u0, v0, w0 = carrier_at(cx, cy, cz, x, y, z, flat)
    xa = wrap(x - u0, counts[0], periodic[0])
    ya = wrap(y - v0, counts[1], periodic[1])
    za = z if flat else wrap(z - w0, counts[2], periodic[2])
    u, v, w = carrier_at(cx, cy, cz, xa, ya, za, flat)
    xd = wrap(x - u, counts[0], periodic[0])
    yd = wrap(y - v, counts[1], periodic[1])
    zd = z if flat else wrap(z - w, counts[2], periodic[2])
    return xd, yd, zd, u0, v0, w0


@kernel
def carry(
    out: Array,
    field: Array,
    valid: Mask,
    cx: Array,
    cy: Array,
    cz: Array,
    offset: Array,
    counts: NDArray[np.int64],
    periodic: Mask,
) -> None:
    """Semi-Lagrangian step of one padded field that lives `offset` cells from the cells' corners.

    NumPy:  out[x] = interpolate(field, x - dt c(x_d))
    """
    flat = counts[2] == 1
    sx, sy, sz = 1.0 - offset[0], 1.0 - offset[1], 1.0 - offset[2]
    for i in prange(out.shape[0]):
        for j in range(out.shape[1]):
            for k in range(out.shape[2]):
                x, y, z = i + offset[0], j + offset[1], k + offset[2]
                xd, yd, zd, _, _, _ = departure(cx, cy, cz, x, y, z, counts, periodic, flat)
                out[i, j, k] = sample_valid(field, valid, xd + sx, yd + sy, zd + sz)


@kernel
def curvature(a: float, b: float, c: float, d: float) -> float:
    """Smaller second difference of four samples, 0 where they disagree in sign."""
    first, second = a - 2.0 * b + c, b - 2.0 * c + d
    if first * second <= 0.0:
        return 0.0
    return min(abs(first), abs(second))


@kernel
def limit(value: float, field: Array, x: float, y: float, z: float, room: float) -> float:
    """`value` held between the samples around (x, y, z), with room for a smooth extremum.

    room  allowed beyond them, in second differences on each axis
    """
    i, j, k, layers = int(x), int(y), 0, 1
    flat = field_is_flat(field)
    if not flat:
        k, layers = int(z), 2
    low, high = field[i, j, k], field[i, j, k]
    for m in range(2):
        for n in range(2):
            for p in range(layers):
                low = min(low, field[i + m, j + n, k + p])
                high = max(high, field[i + m, j + n, k + p])
    if low <= value <= high:
        return value
    if room == 0.0:
        return min(max(value, low), high)
    along = 0.0
    if 0 < i < field.shape[0] - 2:
        for n in range(2):
            for p in range(layers):
                along = max(
                    along,
                    curvature(
                        field[i - 1, j + n, k + p],
                        field[i, j + n, k + p],
                        field[i + 1, j + n, k + p],
                        field[i + 2, j + n, k + p],
                    ),
                )
    across = 0.0
    if 0 < j < field.shape[1] - 2:
        for m in range(2):
            for p in range(layers):
                across = max(
                    across,
                    curvature(
                        field[i + m, j - 1, k + p],
                        field[i + m, j, k + p],
                        field[i + m, j + 1, k + p],
                        field[i + m, j + 2, k + p],
                    ),
                )
    upright = 0.0
    if not flat and 0 < k < field.shape[2] - 2:
        for m in range(2):
            for n in range(2):
                upright = max(
                    upright,
                    curvature(
                        field[i + m, j + n, k - 1],
                        field[i + m, j + n, k],
                        field[i + m, j + n, k + 1],
                        field[i + m, j + n, k + 2],
                    ),
                )
    beyond = room * (along + across + upright)
    return min(max(value, low - beyond), high + beyond)


@inlined
def within(departed: float, arrives: float, count: int, periodic: bool) -> bool:
    """Whether a path neither began at a side of the domain nor leaves through one."""
    return periodic or (0.0 < departed < count and 0.0 <= arrives <= count)


@kernel
def correct(
    out: Array,
    carried: Array,
    field: Array,
    valid: Mask,
    cx: Array,
    cy: Array,
    cz: Array,
    offset: Array,
    counts: NDArray[np.int64],
    periodic: Mask,
    room: float,
) -> None:
    """MacCormack correction of `carried` (padded, by `carry`); written to `out`.

    room  see `limit`

    NumPy:  out = limit(carried + (field - interpolate(carried, x + dt c)) / 2)
    """
    flat = counts[2] == 1
    sx, sy, sz = 1.0 - offset[0], 1.0 - offset[1], 1.0 - offset[2]
    pz = 0 if flat else 1
    for i in prange(out.shape[0]):
        for j in range(out.shape[1]):
            for k in range(out.shape[2]):
                x, y, z = i + offset[0], j + offset[1], k + offset[2]
                value = carried[i + 1, j + 1, k + pz]
                xd, yd, zd, u, v, w = departure(cx, cy, cz, x, y, z, counts, periodic, flat)
                xf, yf, zf = x + u, y + v, z + w
                inside = within(xd, xf, counts[0], periodic[0])
                inside = inside and within(yd, yf, counts[1], periodic[1])
                if inside and (flat or within(zd, zf, counts[2], periodic[2])):
                    xf = wrap(xf, counts[0], periodic[0])
                    yf = wrap(yf, counts[1], periodic[1])
                    zf = z if flat else wrap(zf, counts[2], periodic[2])
                    whole = valid[i + 1, j + 1, k + pz]
                    whole = whole and all_valid(valid, xd + sx, yd + sy, zd + sz)
                    if whole and all_valid(valid, xf + sx, yf + sy, zf + sz):
                        back = sample(carried, xf + sx, yf + sy, zf + sz)
                        value = limit(
                            value + 0.5 * (field[i + 1, j + 1, k + pz] - back),
                            field,
                            xd + sx,
                            yd + sy,
                            zd + sz,
                            room,
                        )
                out[i, j, k] = value


OFFSETS = (np.array([0.0, 0.5, 0.5]), np.array([0.5, 0.0, 0.5]), np.array([0.5, 0.5, 0.0]))
"""Where the faces across each axis live, in cells from the corner of their cell."""

CENTRE = np.array([0.5, 0.5, 0.5])


def cells_per_step(velocity: Faces, dt: float, spacing: float) -> Faces:
    """Padded carrying velocity in cells per step."""
    u, v, w = (dt / spacing * values for values in velocity)
    return u, v, w
