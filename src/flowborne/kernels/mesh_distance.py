"""Signed distance to a closed mesh by a search through all its triangles."""

from __future__ import annotations

import numpy as np
from numba import njit

from flowborne.kernels.arrays import Array, Integers
from flowborne.kernels.triangles import (
    closest_on_triangle,
    squared_distance,
)


@njit(nogil=True, cache=True)
def distances_to_mesh(points: Array, vertices: Array, faces: Integers) -> Array:
    """(n,) signed distances of points (n, 3) to a closed mesh, negative inside, m.

    The sign is that of the winding number (van Oosterom and Strackee 1983).
    """
    distance = np.empty(len(points))
    for n in range(len(points)):
        p = points[n]
        nearest, angle = 1e30, 0.0
        for t in range(faces.shape[0]):
            a, b, c = vertices[faces[t, 0]], vertices[faces[t, 1]], vertices[faces[t, 2]]
            closest = closest_on_triangle(p, a, b, c)
            nearest = min(nearest, squared_distance(p, a, b, c, closest))
            u, v, w = a - p, b - p, c - p
            lu, lv, lw = np.sqrt(u.dot(u)), np.sqrt(v.dot(v)), np.sqrt(w.dot(w))
            triple = (
                u[0] * (v[1] * w[2] - v[2] * w[1])
                + u[1] * (v[2] * w[0] - v[0] * w[2])
                + u[2] * (v[0] * w[1] - v[1] * w[0])
            )
            below = lu * lv * lw + u.dot(v) * lw + v.dot(w) * lu + w.dot(u) * lv
            angle += 2.0 * np.arctan2(triple, below)
        away = np.sqrt(nearest)
        distance[n] = -away if angle > 2.0 * np.pi else away
    return distance
