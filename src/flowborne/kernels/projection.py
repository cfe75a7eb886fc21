"""Divergence and pressure gradient on cut cells, and the pressure of cells that have opened.

A slab is a room one layer thick along its first axis, as in `flux`.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from flowborne.kernels.arrays import Array, Faces, Integers, Marks
from flowborne.kernels.control_volumes import neighbour
from flowborne.kernels.dye import face_of
from flowborne.kernels.jit import inlined, kernel

Volumes = tuple[Array, Array, Array, Array]
Fields = tuple[Array, Array, Array]
Box = tuple[tuple[int, int], tuple[int, int], tuple[int, int]]


@kernel
def net_out(out: Array, qx: Array, qy: Array, qz: Array) -> None:
    """Net volume that leaves each cell per time, of the volume per time through its faces."""
    deep = qx.shape[0] - out.shape[0]
    for i in prange(out.shape[0]):
        for j in range(out.shape[1]):
            for k in range(out.shape[2]):
                total = qx[i + deep, j, k] - qx[i, j, k]
                total = total + qy[i, j + 1, k] - qy[i, j, k]
                out[i, j, k] = total + qz[i, j, k + 1] - qz[i, j, k]


@inlined
def surplus(flux: Faces, volumes: Volumes, i: int, j: int, k: int, dt: float) -> float:
    """Volume per time by which fluxes fill a cell too much; see `mark_unsettled`."""
    (start, rate, _, end), (qx, qy, qz) = volumes, flux
    deep = qx.shape[0] - start.shape[0]
    net = qx[i + deep, j, k] - qx[i, j, k] + qy[i, j + 1, k] - qy[i, j, k]
    net += qz[i, j, k + 1] - qz[i, j, k]
    return (start[i, j, k] - end[i, j, k]) / dt + rate[i, j, k] - net


@kernel
def mark_unsettled(
    marks: Marks, volumes: Volumes, flux: Faces, dt: float, cell: float, slack: float
) -> None:
    """Mark cells that bodies cut, and those that fluxes do not fill.

    volumes  of cells at the start and what is brought in per time; of the cut at the start and at
             the end; as `net_out` takes fields
    cell     volume of a whole cell
    slack    by which the volume after dt may differ from that of the cut
    """
    before, end = volumes[2:]
    for i in prange(marks.shape[0]):
        for j in range(marks.shape[1]):
            for k in range(marks.shape[2]):
                cut = min(before[i, j, k], end[i, j, k]) < cell
                filled = dt * abs(surplus(flux, volumes, i, j, k, dt)) <= slack
                marks[i, j, k] = cut or not filled


@kernel
def fill_around(flux: Faces, volumes: Volumes, box: Box, dt: float) -> None:
    """Let fluxes fill the cells outside a box in dt, in place: each passes its surplus on towards
    the box, along one axis after the other.

    volumes  as in `mark_unsettled`
    box      first cell along each axis, and the one after the last
    """
    (n0, n1, n2), ((a0, b0), (a1, b1), (a2, b2)) = volumes[0].shape, box
    for line in prange(n1 if n0 > b0 - a0 else 0):
        row, qx = np.int64(line), flux[0]  # from within: a loop's arrays count as different ones
        for i in range(a0):
            for k in range(n2):
                qx[i + 1, row, k] += surplus(flux, volumes, i, row, k, dt)
        for i in range(n0 - 1, b0 - 1, -1):
            for k in range(n2):
                qx[i, row, k] -= surplus(flux, volumes, i, row, k, dt)
    for line in prange(b0 - a0):
        row, qy, qz = a0 + np.int64(line), flux[1], flux[2]
        for j in range(a1):
            for k in range(n2):
                qy[row, j + 1, k] += surplus(flux, volumes, row, j, k, dt)
        for j in range(n1 - 1, b1 - 1, -1):
            for k in range(n2):
                qy[row, j, k] -= surplus(flux, volumes, row, j, k, dt)
        for j in range(a1, b1):
            for k in range(a2):
                qz[row, j, k + 1] += surplus(flux, volumes, row, j, k, dt)
            for k in range(n2 - 1, b2 - 1, -1):
                qz[row, j, k] -= surplus(flux, volumes, row, j, k, dt)


@inlined
def push(fields: Fields, i: int, j: int, k: int, scale: float, difference: float) -> None:
    """`subtract_gradient` on one face, between two cells of this difference in pressure."""
    out, velocity, rate = fields
    change = 0.0 if rate[i, j, k] == 0.0 else scale * rate[i, j, k] * difference
    out[i, j, k] = velocity[i, j, k] - change


@kernel
def open_outflow(out: Array, opened: Faces, velocity: Faces, rate: Array, area: float) -> None:
    """Net volume that leaves each cell per time through open parts of its faces, less `rate`."""
    (a0, a1, a2), (u0, u1, u2), deep = opened, velocity, opened[0].shape[0] - out.shape[0]
    for i in prange(out.shape[0]):
        for j in range(out.shape[1]):
            for k in range(out.shape[2]):
                total = a0[i + deep, j, k] * u0[i + deep, j, k] - a0[i, j, k] * u0[i, j, k]
                total = total + a1[i, j + 1, k] * u1[i, j + 1, k] - a1[i, j, k] * u1[i, j, k]
                total = total + a2[i, j, k + 1] * u2[i, j, k + 1] - a2[i, j, k] * u2[i, j, k]
                out[i, j, k] = total * area - rate[i, j, k]


@kernel
def subtract_gradient(
    fields: Fields, pressure: Array, axis: int, scale: float, periodic: bool
) -> None:
    """Give faces across `axis` their velocity less scale rate (p_upper - p_lower).

    fields    for the result, which may be the velocity itself; the velocity; and the rate a A / m:
              faces of which it is 0, as on sides that prescribe the flux, keep their velocity
    scale     dt for a pressure, 1 for p^
    periodic  whether the domain is along the axis; else the pressure beyond the sides is 0
    """
    n, wide = pressure.shape[axis], fields[0].shape[2]
    for row in prange(fields[0].shape[0]):
        i = np.int64(row)  # that of a thread has no sign
        for j in range(fields[0].shape[1]):
            at = i if axis == 0 else j
            below, above = at - 1 if at > 0 else n - 1, at if at < n else 0
            i0, i1 = (below, above) if axis == 0 else (i, i)
            j0, j1 = (below, above) if axis == 1 else (j, j)
            if axis == 2:
                for k in range(1, n):
                    difference = pressure[i, j, k] - pressure[i, j, k - 1]
                    push(fields, i, j, k, scale, difference)
                first, last = pressure[i, j, 0], pressure[i, j, n - 1]
                push(fields, i, j, 0, scale, first - last if periodic else first)
                push(fields, i, j, n, scale, first - last if periodic else -last)
            elif periodic or 0 < at < n:
                for k in range(wide):
                    difference = pressure[i1, j1, k] - pressure[i0, j0, k]
                    push(fields, i, j, k, scale, difference)
            elif at == 0:
                for k in range(wide):
                    push(fields, i, j, k, scale, pressure[i, j, k])
            else:
                for k in range(wide):
                    push(fields, i, j, k, scale, -pressure[i0, j0, k])


@kernel
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
                part = opened[way // 2].reshape(-1)[face]
                total += part * flat[to]
                weight += part
            if weight > 0.0:
                found[n] = total / weight
        for n in range(fresh.size):
            if found[n] != 0.0:
                flat[fresh[n]], spread = found[n], True
