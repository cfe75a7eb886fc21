"""How far points are from a closed surface of triangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flowborne.extras import flesh_library
from flowborne.shapes.shape import Mesh

Array = NDArray[np.float64]


def signed_distance(points: Array, surface: Mesh) -> Array:
    """(n,) signed distances of points (n, 3) to a closed surface, negative inside, m."""
    pv = flesh_library()
    cloud = pv.PolyData(points)
    cloud.compute_implicit_distance(pv.PolyData.from_regular_faces(*surface), inplace=True)
    return np.asarray(cloud["implicit_distance"], dtype=np.float64)
