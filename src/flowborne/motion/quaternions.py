"""Unit quaternions (w, x, y, z) in arrays (..., 4)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def product(first: Array, second: Array) -> Array:
    """(..., 4) the rotation `second` followed by `first`."""
    w, x, y, z = _entries(first)
    a, b, c, d = _entries(second)
    return _rows(
        w * a - x * b - y * c - z * d,
        w * b + x * a + y * d - z * c,
        w * c - x * d + y * a + z * b,
        w * d + x * c - y * b + z * a,
    )


def inverse(quaternion: Array) -> Array:
    """(..., 4) the rotation back."""
    return quaternion * np.array([1.0, -1.0, -1.0, -1.0])


def turned(quaternion: Array, vector: Array) -> Array:
    """(..., 3) vectors (..., 3) after the rotation."""
    w, x, y, z = _entries(quaternion)
    a, b, c = _entries(vector)
    p, q, r = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return _rows(
        a + w * p + y * r - z * q,
        b + w * q + z * p - x * r,
        c + w * r + x * q - y * p,
    )


def about(axis: Array, angle: Array) -> Array:
    """(..., 4) turns by angles (...) in rad about a unit axis (3,)."""
    half = np.asarray(angle)[..., None] / 2.0
    return np.concatenate([np.cos(half), np.sin(half) * axis], axis=-1)


def twist(quaternion: Array, axis: Array) -> Array:
    """(...) angle in rad of the part of a rotation that turns about a unit axis (3,).

    A rotation is its twist after a turn about some axis across.
    """
    return 2.0 * np.arctan2(quaternion[..., 1:] @ axis, quaternion[..., 0])


def angle(quaternion: Array) -> Array:
    """(...) angle of a rotation, rad, from 0 to pi."""
    size = np.linalg.norm(quaternion[..., 1:], axis=-1)
    return np.asarray(2.0 * np.arctan2(size, np.abs(quaternion[..., 0])))


def continuous(quaternions: Array) -> Array:
    """(n, ..., 4) the same rotations, signs chosen so that each is nearest to the one before."""
    flips = np.sum(quaternions[1:] * quaternions[:-1], axis=-1, keepdims=True) < 0.0
    signs = np.cumprod(np.where(flips, -1.0, 1.0), axis=0)
    return np.concatenate([quaternions[:1], quaternions[1:] * signs])


def _entries(array: Array) -> list[Array]:
    return [array[..., entry] for entry in range(array.shape[-1])]


def _rows(*entries: Array) -> Array:
    result = np.empty((*np.shape(entries[0]), len(entries)))
    for place, entry in enumerate(entries):
        result[..., place] = entry
    return result
