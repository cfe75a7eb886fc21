"""Divergence and pressure gradient on cut cells."""

from __future__ import annotations

from numba import prange

from flowborne.kernels.arrays import Array, Integers
from flowborne.kernels.jit import kernel
from flowborne.kernels.sides import CLOSED, PERIODIC


@kernel
def outflow(out: Array, u: Array, v: Array, w: Array, ax: Array, ay: Array, az: Array) -> None:
    """Net volume that leaves each cell per area of a full face: sum of a (u . outward), m/s."""
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
def net_out(out: Array, qx: Array, qy: Array, qz: Array) -> None:
    """Net volume that leaves each cell per time, of the volume per time through its faces."""
    for i in prange(out.shape[0]):
        for j in range(out.shape[1]):
            for k in range(out.shape[2]):
                out[i, j, k] = (
                    qx[i + 1, j, k]
                    - qx[i, j, k]
                    + qy[i, j + 1, k]
                    - qy[i, j, k]
                    + qz[i, j, k + 1]
                    - qz[i, j, k]
                )


@kernel
def subtract_gradient(
    velocity: Array,
    rate: Array,
    pressure: Array,
    axis: int,
    scale: float,
    codes: Integers,
) -> None:
    """Subtract scale rate (p_upper - p_lower) from the velocity of the faces across `axis`.

    rate   a A / m
    scale  dt for a pressure, 1 for p^. Faces that are wholly closed, and those on closed sides,
           keep their velocity; beyond an open side the pressure is 0
    """
    n = pressure.shape[axis]
    di, dj, dk = int(axis == 0), int(axis == 1), int(axis == 2)
    for i in prange(velocity.shape[0]):
        for j in range(velocity.shape[1]):
            for k in range(velocity.shape[2]):
                if rate[i, j, k] == 0.0:
                    continue
                at = i if axis == 0 else (j if axis == 1 else k)
                if 0 < at < n:
                    difference = pressure[i, j, k] - pressure[i - di, j - dj, k - dk]
                elif at == 0:
                    if codes[axis, 0] == CLOSED:
                        continue
                    difference = pressure[i, j, k]
                    if codes[axis, 0] == PERIODIC:
                        far = pressure[i + di * (n - 1), j + dj * (n - 1), k + dk * (n - 1)]
                        difference = pressure[i, j, k] - far
                else:
                    if codes[axis, 1] == CLOSED:
                        continue
                    difference = -pressure[i - di, j - dj, k - dk]
                    if codes[axis, 1] == PERIODIC:
                        difference = (
                            pressure[i - di * n, j - dj * n, k - dk * n]
                            - pressure[i - di, j - dj, k - dk]
                        )
                velocity[i, j, k] -= scale * rate[i, j, k] * difference
