"""The kernels of `distance` in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array
from flowborne.kernels.distance import CAPSULE, CYLINDER, ELLIPSOID, MESH, SPHERE, Samples


def signed_distance_reference(kind: int, size: Array, points: Array, samples: Samples) -> Array:
    """(n,) `signed_distance` of points (n, 3) in NumPy."""
    if kind == MESH:
        from scipy.ndimage import map_coordinates  # for this statement alone

        place = (points - samples.corner) / samples.pitch
        inside = np.clip(place, 0.0, np.array(samples.values.shape) - 1.001)
        away = samples.pitch * np.linalg.norm(place - inside, axis=1)
        return np.asarray(map_coordinates(samples.values, inside.T, order=1) + away)
    if kind == ELLIPSOID:
        k0, k1 = (np.linalg.norm(points / size**n, axis=1) for n in (1, 2))
        return np.asarray(k0 * (k0 - 1.0) / k1)
    if kind in (SPHERE, CAPSULE):
        axis = np.array([0.0, 0.0, size[1] if kind == CAPSULE else 0.0])
        return np.linalg.norm(points - np.clip(points, -axis, axis), axis=1) - size[0]
    beyond = np.abs(points) - size
    if kind == CYLINDER:
        across = np.hypot(points[:, 0], points[:, 1]) - size[0]
        beyond = np.stack([across, np.abs(points[:, 2]) - size[1]], axis=1)
    outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
    return np.asarray(outside + np.minimum(beyond.max(axis=1), 0.0))
