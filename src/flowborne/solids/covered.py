"""Which geometries of bones lie inside flesh, where no fluid reaches them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def winding(point: Array, vertices: Array, triangles: NDArray[np.int64]) -> float:
    """How often a closed surface goes around a point (van Oosterom and Strackee 1983)."""
    u, v, w = np.moveaxis((vertices - point)[triangles], 1, 0)
    lengths = [np.sqrt(np.einsum("td,td->t", x, x)) for x in (u, v, w)]
    below = lengths[0] * lengths[1] * lengths[2]
    for (a, b), c in zip(((u, v), (v, w), (w, u)), (2, 0, 1), strict=True):
        below = below + np.einsum("td,td->t", a, b) * lengths[c]
    triple = np.einsum("td,td->t", u, np.cross(v, w))
    return float(np.arctan2(triple, below).sum()) / (2.0 * np.pi)


def covered(
    geoms: Sequence[Array], vertices: Array, triangles: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """(n,) whether all points (k, 3) of each geometry lie inside a closed surface."""
    return np.array(
        [all(winding(point, vertices, triangles) > 0.5 for point in geom) for geom in geoms], bool
    )
