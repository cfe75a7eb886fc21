"""Which geometries of bones lie inside flesh, where no fluid reaches them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def winding(points: Array, vertices: Array, triangles: NDArray[np.int64]) -> Array:
    """(n,) how often a closed surface goes around each point (van Oosterom and Strackee 1983)."""
    turns = np.empty(len(points))
    for n, point in enumerate(points):
        u, v, w = np.moveaxis(vertices[triangles] - point, 1, 0)
        lengths = [np.linalg.norm(x, axis=1) for x in (u, v, w)]
        below = lengths[0] * lengths[1] * lengths[2]
        for (a, b), c in zip(((u, v), (v, w), (w, u)), (2, 0, 1), strict=True):
            below = below + (a * b).sum(axis=1) * lengths[c]
        triple = (u * np.cross(v, w)).sum(axis=1)
        turns[n] = np.arctan2(triple, below).sum() / (2.0 * np.pi)
    return turns


def covered(
    geoms: Sequence[Array], vertices: Array, triangles: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """(n,) whether all points (k, 3) of each geometry lie inside a closed surface."""
    return np.array([bool((winding(g, vertices, triangles) > 0.5).all()) for g in geoms], bool)
