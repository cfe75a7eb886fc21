"""Semi-Lagrangian advection along particle paths: the paper's own scheme.

A particle that arrives at x after dt left x_d, with  x_d = x - dt c(x_d)  for the velocity c that
it has half-way. Positions are in cells from the domain's lower corner; fields carry one layer of
ghosts (see `ghosts`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flowborne.fluid.grid import Array, Faces
from flowborne.kernels.jit import inlined, kernel, prange

Mask = NDArray[np.uint8]


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
def wrap(x: float, count: int, periodic: bool) -> float:
    """Position back inside the domain: around where periodic, else to its side (NaN: to 0)."""
    if periodic:
        x -= count * np.floor(x / count)
    if not x >= 0.0:
        return 0.0
    return x if x < count else float(count)


@inlined
def advecting_velocity_at(
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
) -> tuple[float, float, float]:
    """Where the particle that arrives at (x, y, z) came from."""
    flat = counts[2] == 1
    u0, v0, w0 = advecting_velocity_at(cx, cy, cz, x, y, z, flat)
    xa = wrap(x - u0, counts[0], periodic[0])
    ya = wrap(y - v0, counts[1], periodic[1])
    za = z if flat else wrap(z - w0, counts[2], periodic[2])
    u, v, w = advecting_velocity_at(cx, cy, cz, xa, ya, za, flat)
    xd = wrap(x - u, counts[0], periodic[0])
    yd = wrap(y - v, counts[1], periodic[1])
    zd = z if flat else wrap(z - w, counts[2], periodic[2])
    return xd, yd, zd


@kernel
def carry(
    out: Array,
    field: Array,
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
    sx, sy, sz = 1.0 - offset[0], 1.0 - offset[1], 1.0 - offset[2]
    for i in prange(out.shape[0]):
        for j in range(out.shape[1]):
            for k in range(out.shape[2]):
                x, y, z = i + offset[0], j + offset[1], k + offset[2]
                xd, yd, zd = departure(cx, cy, cz, x, y, z, counts, periodic)
                out[i, j, k] = sample(field, xd + sx, yd + sy, zd + sz)


OFFSETS = (np.array([0.0, 0.5, 0.5]), np.array([0.5, 0.0, 0.5]), np.array([0.5, 0.5, 0.0]))
"""Where the faces across each axis live, in cells from the corner of their cell."""

CENTRE = np.array([0.5, 0.5, 0.5])


def cells_per_step(velocity: Faces, dt: float, spacing: float) -> Faces:
    """Padded carrying velocity in cells per step."""
    u, v, w = (dt / spacing * values for values in velocity)
    return u, v, w
