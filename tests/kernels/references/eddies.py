"""The kernels of `eddies` as matrices: what edges give is W C u / 64, and it takes C^T / V of that
from u."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from flowborne.kernels.arrays import Array, Integers


def circulation_matrix(places: Integers, axis: int, fields: tuple[Array, Array]) -> Array:
    """(edges, faces) C: circulation of the faces of u, then of those of v.

    places  (edges, 3) indices of the edges along `axis`
    """
    found = np.zeros((len(places), sum(field.size for field in fields)))
    for row, above in zip(found, places, strict=True):
        for m, field in enumerate(fields):
            below, along, first = above.copy(), (axis + 2 - m) % 3, m * fields[0].size
            below[along] = (above[along] - 1) % field.shape[along]
            row[first + np.ravel_multi_index(above, field.shape)] = 2 * m - 1
            row[first + np.ravel_multi_index(below, field.shape)] = 1 - 2 * m
    return found


def exchange_matrix(
    places: Integers, axis: int, wraps: Integers, least: Array, part: Array
) -> Array:
    """(edges, edges) W: mean part and smallest volume V of both edges beside each other across the
    axis.

    least, part  of each edge
    """
    found = np.zeros((least.size, least.size))
    for m, n in combinations(range(least.size), 2):
        apart = np.abs(places[m] - places[n])
        apart = np.where(wraps > 0, np.minimum(apart, wraps - apart), apart)
        if apart.sum() == 1 and apart[axis] == 0:
            weight = 0.5 * (part[m] + part[n]) * min(least[m], least[n])
            found[[m, n], [m, n]] += weight
            found[[m, n], [n, m]] -= weight
    return found
