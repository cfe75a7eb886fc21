"""The kernels of `volumes` in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.volumes import TETRAHEDRA, Array

from .closed_fractions import face_closed_reference


def closed_tetrahedron_reference(corners: Array) -> Array:
    """`closed_tetrahedron` in NumPy, of corner values (..., 4) that differ from each other.

    The part below zero is a spline of third degree in the corner values (Curry and Schoenberg).
    """
    others = corners[..., None, :] - corners[..., :, None]
    others[..., range(4), range(4)] = 1.0
    return np.asarray((np.maximum(-corners, 0.0) ** 3 / others.prod(axis=-1)).sum(axis=-1))


def open_parts_reference(distance: Array, ox: Array, oy: Array, oz: Array) -> Array:
    """`open_parts` in NumPy; distances at the corners of a room's cells differ from each other."""
    faces = ox[1:] + ox[:-1] + oy[:, 1:] + oy[:, :-1]
    if distance.shape[2] == 2:
        closed = face_closed_reference(distance[:, :, :1], 2)
    else:
        faces = faces + oz[:, :, 1:] + oz[:, :, :-1]
        low, high = slice(None, -1), slice(1, None)
        corner = np.stack(
            [distance[x, y, z] for x in (low, high) for y in (low, high) for z in (low, high)],
            axis=-1,
        )
        closed = closed_tetrahedron_reference(corner[..., TETRAHEDRA]).mean(axis=-1)
    return np.where(faces == 0.0, 0.0, 1.0 - closed)
