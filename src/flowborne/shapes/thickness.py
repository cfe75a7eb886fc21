"""How thick a body of triangles is."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flowborne.kernels.thickness import way_inward

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

RIMS = 0.05
"""Part of a skin's area that may be thinner: around rims, where both sides meet."""


def thinnest(vertices: Array, triangles: Indices, slab: bool) -> float:
    """Thickness in m that all of a closed skin has but for its `RIMS`.

    vertices, triangles  (n, 3) m; (k, 3) outward
    slab                 whether its faces across z are cuts, not skin
    """
    corners = vertices[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normal, axis=1)
    if slab:
        area[np.abs(normal[:, 2]) > 0.5 * area] = 0.0
    longest = float(np.ptp(vertices, axis=0).max())
    for halvings in range(5, -2, -1):
        way = way_inward(vertices, triangles, longest / 2.0**halvings)
        if area[np.isfinite(way)].sum() >= RIMS * area.sum():
            break
    order = np.argsort(way)
    part = np.cumsum(area[order]) / area.sum()
    return float(way[order][np.searchsorted(part, RIMS)])
