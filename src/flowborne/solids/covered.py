"""Which geometries of bones lie inside flesh, where no fluid reaches them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flowborne.solids.slab import Mesh

Array = NDArray[np.float64]

AROUND = np.array([d for d in np.ndindex(3, 3, 3) if d != (1, 1, 1)], np.float64) - 1.0
"""The 26 directions to the neighbours of a cell."""


def outline_points(kind: str, size: Array, mesh: Mesh | None) -> Array:
    """(n, 3) points all over the surface of a geometry, in its frame, m."""
    if mesh is not None:
        return mesh[0]
    toward = AROUND / np.linalg.norm(AROUND, axis=1, keepdims=True)
    if kind == "sphere":
        return size[0] * toward
    if kind == "ellipsoid":
        return toward * size
    if kind == "capsule":
        return size[0] * toward + np.sign(AROUND) * [0.0, 0.0, size[1]]
    if kind == "cylinder":
        across = np.linalg.norm(AROUND[:, :2], axis=1, keepdims=True)
        ring = AROUND[:, :2] / np.maximum(across, 1.0)
        return np.concatenate([size[0] * ring, size[1] * AROUND[:, 2:]], axis=1)
    return AROUND * size


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
