"""The kernels of `crossings` in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Integers


def crossings_reference(
    vertices: Array, triangles: Integers, origins: Array, direction: Array
) -> tuple[Integers, Array, Array]:
    """`crossings` in NumPy, every line with every triangle."""
    lines, places, signs = [], [], []
    for first, second, third in vertices[triangles]:
        e, f = second - first, third - first
        p = np.cross(direction, f)
        determinant = float(e @ p)
        if abs(determinant) < 1e-300:
            continue
        s = origins - first
        u = s @ p / determinant
        q = np.cross(s, e)
        v = q @ direction / determinant
        hit = np.flatnonzero((u >= 0.0) & (v >= 0.0) & (u + v < 1.0))
        lines.append(hit)
        places.append(q[hit] @ f / determinant)
        signs.append(np.full(hit.size, np.sign(determinant)))
    return np.concatenate(lines), np.concatenate(places), np.concatenate(signs)
