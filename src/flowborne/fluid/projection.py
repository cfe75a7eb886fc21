"""Divergence and gradient on cut cells: the two sides of the pressure equation.

With face areas A, open fractions a and p^ = p dt,

    net outflow of a cell   D u  = sum over its faces of a A (u . outward)
    velocity change         u   -= (1/rho) (p^_upper - p^_lower) / h
    weights of the matrix   w    = a A / (rho h)        (doubled at an open side, half a cell away)

so that momentum taken from a face, a rho V du, is what its two cells push with.
"""

from __future__ import annotations

import numpy as np
from numba import prange
from numpy.typing import NDArray

from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.ghosts import edge
from flowborne.fluid.grid import Array, Faces, Grid
from flowborne.fluid.jit import kernel

CLOSED, OPEN, PERIODIC = range(3)
"""What a side is to the pressure: a wall or an inflow, p = 0, or the opposite side."""


def side_codes(boundaries: Boundaries) -> NDArray[np.int64]:
    """(3, 2) CLOSED, OPEN or PERIODIC for the lower and upper side of each axis."""
    code = {"open": OPEN, "periodic": PERIODIC}
    return np.array(
        [[code.get(side.kind, CLOSED) for side in boundaries.pair(axis)] for axis in range(3)]
    )


def face_weights(opened: Faces, grid: Grid, boundaries: Boundaries, density: float) -> Faces:
    """Weights w of the pressure matrix, m^4/kg times area over spacing; see the module."""
    scale = grid.face_area / (density * grid.spacing)
    weights = [scale * values for values in opened]
    codes = side_codes(boundaries)
    for axis in range(3):
        for end, layer in ((0, 0), (1, -1)):
            if codes[axis, end] == CLOSED:
                weights[axis][edge(axis, layer)] = 0.0
            elif codes[axis, end] == OPEN:
                weights[axis][edge(axis, layer)] *= 2.0
    return weights[0], weights[1], weights[2]


@kernel
def outflow(out: Array, u: Array, v: Array, w: Array, ax: Array, ay: Array, az: Array) -> None:
    """Net volume that leaves each cell per area of a full face: sum of a (u . outward), m/s.

    NumPy:  out = diff(ax * u, axis=0) + diff(ay * v, axis=1) + diff(az * w, axis=2)
    """
    for i in prange(out.shape[0]):
        for j in range(out.shape[1]):
            for k in range(out.shape[2]):
                out[i, j, k] = (
                    ax[i + 1, j, k] * u[i + 1, j, k]
                    - ax[i, j, k] * u[i, j, k]
                    + ay[i, j + 1, k] * v[i, j + 1, k]
                    - ay[i, j, k] * v[i, j, k]
                    + az[i, j, k + 1] * w[i, j, k + 1]
                    - az[i, j, k] * w[i, j, k]
                )


@kernel
def push_faces(
    velocity: Array,
    opened: Array,
    pressure: Array,
    axis: int,
    scale: float,
    codes: NDArray[np.int64],
) -> None:
    """Subtract scale (p_upper - p_lower) from the velocity of the faces across `axis`.

    scale  dt / (rho h) for a pressure, 1 / (rho h) for p^. Faces that are wholly closed, and those
    on closed sides, keep their velocity; on an open side the pressure is 0 half a cell away.
    """
    n = pressure.shape[axis]
    di, dj, dk = int(axis == 0), int(axis == 1), int(axis == 2)
    for i in prange(velocity.shape[0]):
        for j in range(velocity.shape[1]):
            for k in range(velocity.shape[2]):
                if opened[i, j, k] == 0.0:
                    continue
                at = i if axis == 0 else (j if axis == 1 else k)
                if 0 < at < n:
                    difference = pressure[i, j, k] - pressure[i - di, j - dj, k - dk]
                elif at == 0:
                    if codes[axis, 0] == CLOSED:
                        continue
                    difference = 2.0 * pressure[i, j, k]
                    if codes[axis, 0] == PERIODIC:
                        far = pressure[i + di * (n - 1), j + dj * (n - 1), k + dk * (n - 1)]
                        difference = pressure[i, j, k] - far
                else:
                    if codes[axis, 1] == CLOSED:
                        continue
                    difference = -2.0 * pressure[i - di, j - dj, k - dk]
                    if codes[axis, 1] == PERIODIC:
                        difference = (
                            pressure[i - di * n, j - dj * n, k - dk * n]
                            - pressure[i - di, j - dj, k - dk]
                        )
                velocity[i, j, k] -= scale * difference


def push(
    velocity: Faces,
    opened: Faces,
    pressure: Array,
    grid: Grid,
    boundaries: Boundaries,
    scale: float,
) -> None:
    """Subtract scale (p_upper - p_lower) on every face, in place; see `push_faces`."""
    codes = side_codes(boundaries)
    for axis in grid.axes:
        push_faces(velocity[axis], opened[axis], pressure, axis, scale, codes)
