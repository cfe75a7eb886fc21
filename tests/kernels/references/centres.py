"""The kernels of `centres` in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array


def cell_edges(size: int, cells: int) -> Array:
    """Where cells of `size` finest cells each begin and end, in finest cells; the last is cut."""
    return np.append(np.arange(0, cells, size), cells).astype(np.float64)


def distance_ratio_reference(
    face: int, factor: int, fine: int, cells: int, periodic: bool
) -> float:
    """`distance_ratio` in NumPy."""
    distance = []
    for size, at in ((fine, factor * face), (fine * factor, face)):
        width = np.diff(cell_edges(size, cells))
        beyond = (width[-1:], width[:1]) if periodic else ([0.0], [0.0])
        width = np.concatenate([beyond[0], width, beyond[1]])
        at = min(at, len(width) - 2)
        distance.append(0.5 * (width[at] + width[at + 1]))
    return float(distance[0] / distance[1])


def interpolation_weights_reference(
    n: int, factor: int, size: int, cells: int, periodic: bool
) -> Array:
    """`interpolation_weights` in NumPy: (n + 2,)."""
    interpolation = np.zeros(n + 2)
    if factor == 2:
        fine, coarse = cell_edges(size, cells), cell_edges(2 * size, cells)
        centre, over = 0.5 * (fine[1:] + fine[:-1]), 0.5 * (coarse[1:] + coarse[:-1])
        width = np.diff(coarse)
        beyond = (width[-1:], width[:1]) if periodic else ([0.0], [0.0])
        width = np.concatenate([beyond[0], width, beyond[1]])
        parent = np.arange(n) // 2
        offset = centre - over[parent]
        reach = 0.5 * (width[parent + 1] + width[parent + 1 + np.sign(offset).astype(int)])
        interpolation[1:-1] = offset / reach
    if periodic:
        interpolation[0], interpolation[-1] = interpolation[-2], interpolation[1]
    return interpolation
