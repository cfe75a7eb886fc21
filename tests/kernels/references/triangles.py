"""The kernels of `triangles` in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array


def closest_on_triangle_reference(p: Array, corners: Array) -> Array:
    """(3,) `closest_on_triangle` in NumPy, for corners (3, 3): the best of the foot of the plumb
    line, where it is inside, and of the points closest on the edges."""
    a, b, c = corners
    edges = np.stack([b - a, c - a], axis=1)
    s, t = np.linalg.lstsq(edges, p - a, rcond=None)[0]
    found = [np.array([1.0 - s - t, s, t])] if min(s, t, 1.0 - s - t) >= 0.0 else []
    for n in range(3):
        along = corners[n - 2] - corners[n]
        part = np.clip((p - corners[n]) @ along / (along @ along), 0.0, 1.0)
        found.append((1.0 - part) * np.eye(3)[n] + part * np.eye(3)[n - 2])
    return min(found, key=lambda weights: float(np.linalg.norm(weights @ corners - p)))
