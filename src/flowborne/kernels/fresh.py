"""Pressure of cells that have opened in a step, and had none before."""

from __future__ import annotations

import numpy as np
from numba import njit

from flowborne.kernels.arrays import Array, Faces, Integers
from flowborne.kernels.control_volumes import across_axis, neighbour
from flowborne.kernels.cut_dye import face_of


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
