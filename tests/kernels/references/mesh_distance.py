"""The kernels of `mesh_distance` in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Integers

from .triangles import closest_on_triangle_reference


def distances_to_mesh_reference(points: Array, vertices: Array, faces: Integers) -> Array:
    """`distances_to_mesh` in NumPy."""
    corners, distance = vertices[faces], np.empty(len(points))
    for n, p in enumerate(points):
        closest = [closest_on_triangle_reference(p, one) @ one for one in corners]
        away = np.linalg.norm(np.array(closest) - p, axis=1).min()
        u, v, w = np.moveaxis(corners - p, 1, 0)
        lu, lv, lw = (np.linalg.norm(side, axis=1) for side in (u, v, w))
        triple = np.einsum("td,td->t", u, np.cross(v, w))
        below = lu * lv * lw
        for one, other, length in ((u, v, lw), (v, w, lu), (w, u, lv)):
            below += np.einsum("td,td->t", one, other) * length
        distance[n] = -away if np.arctan2(triple, below).sum() > np.pi else away
    return distance
