"""Distances between the centres of cells of two levels along one axis."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Real
from flowborne.kernels.jit import kernel


@kernel
def distance_ratio(face: int, factor: int, fine: int, cells: int, periodic: bool) -> float:
    """Distance between the centres beside fine face `factor * face` over that of the coarse face.

    face    of the coarse level, 0 to its last
    factor  1 or 2, the coarsening of this axis
    fine    finest cells in a fine cell of this axis; `cells` finest cells in all
    """
    ratio = np.zeros(2)
    for n in range(2):
        size = fine if n == 0 else fine * factor
        count = (cells + size - 1) // size
        at = min(factor * face, count) if n == 0 else face
        below, above = at - 1, at
        if periodic:
            below, above = below % count, above % count
        for c in (below, above):
            if 0 <= c < count:
                ratio[n] += min(size, cells - c * size)
    return float(ratio[0] / ratio[1])


@kernel
def interpolation_weights(
    interpolation: Real, n: int, factor: int, size: int, cells: int, periodic: bool
) -> None:
    """How far each fine cell's centre lies from its coarse cell's towards the next coarse cell.

    interpolation  (n + 2,) with ghosts: fraction of the distance between the coarse centres (at
                   an open side: of that to the side), negative towards the lower neighbour
    size      finest cells in a fine cell of this axis, `cells` finest cells in all
    """
    interpolation[:] = 0.0
    if factor == 1:
        return
    count = (n + 1) // 2
    for i in range(n):
        c = i // 2
        first, second = 2 * c, 2 * c + 1
        if second >= n:
            continue
        a = float(min(size, cells - first * size))
        b = float(min(size, cells - second * size))
        other = c - 1 if i == first else c + 1
        if periodic:
            other = other % count
        width = 0.0
        if 0 <= other < count:
            width = float(min(2 * size, cells - other * 2 * size))
        reach = a + b + width
        interpolation[i + 1] = -b / reach if i == first else a / reach
    if periodic:
        interpolation[0], interpolation[n + 1] = interpolation[n], interpolation[1]
