"""Divergence on cut cells."""

from __future__ import annotations

from numba import prange

from flowborne.kernels.arrays import Array
from flowborne.kernels.jit import kernel


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
