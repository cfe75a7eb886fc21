"""Divergence and pressure gradient on cut cells, and the pressure of cells that have opened."""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from flowborne.kernels.arrays import Array, Faces, Integers
from flowborne.kernels.control_volumes import across_axis, neighbour
from flowborne.kernels.dye import face_of
from flowborne.kernels.jit import kernel


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
    velocity: Array, rate: Array, pressure: Array, axis: int, scale: float, periodic: bool
) -> None:
    """Subtract scale rate (p_upper - p_lower) from the velocity of the faces across `axis`.

    rate      a A / m; faces of which it is 0, as on sides that prescribe the flux, keep their
              velocity
    scale     dt for a pressure, 1 for p^
    periodic  whether the domain is along the axis; else the pressure beyond the sides is 0
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
                    difference = pressure[i, j, k]
                    if periodic:
                        far = pressure[i + di * (n - 1), j + dj * (n - 1), k + dk * (n - 1)]
                        difference = pressure[i, j, k] - far
                else:
                    difference = -pressure[i - di, j - dj, k - dk]
                    if periodic:
                        difference = (
                            pressure[i - di * n, j - dj * n, k - dk * n]
                            - pressure[i - di, j - dj, k - dk]
                        )
                velocity[i, j, k] -= scale * rate[i, j, k] * difference


@njit(nogil=True, cache=True)
def fill_fresh(pressure: Array, opened: Faces, fresh: Integers, wraps: Integers) -> None:
    """Give cells without a pressure the mean of those beside them, weighted by the open parts of
    the faces between them, in place; from there on to the cells behind them.

    pressure  of each cell, 0 where there is none
    opened    open part of each face
    fresh     (n,) flat indices of the cells without one
    wraps     (3,) number of cells along each periodic axis, else 0
    """
    flat, shape, found = pressure.reshape(-1), np.array(pressure.shape), np.zeros(fresh.size)
    spread = True
    while spread:
        spread, found[:] = False, 0.0
        for n in range(fresh.size):
            total, weight = 0.0, 0.0
            for way in range(6 if flat[fresh[n]] == 0.0 else 0):
                to = neighbour(shape, wraps, fresh[n], way)
                if to < 0 or flat[to] == 0.0:
                    continue
                face = face_of(shape, way // 2, fresh[n], way % 2)
                part = across_axis(opened, way // 2).reshape(-1)[face]
                total += part * flat[to]
                weight += part
            if weight > 0.0:
                found[n] = total / weight
        for n in range(fresh.size):
            if found[n] != 0.0:
                flat[fresh[n]], spread = found[n], True
