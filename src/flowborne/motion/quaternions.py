"""Unit quaternions (w, x, y, z) in arrays (..., 4)."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array


def product(first: Array, second: Array) -> Array:
    """(..., 4) the rotation `second` followed by `first`."""
    w, x, y, z = np.moveaxis(first, -1, 0)
    a, b, c, d = np.moveaxis(second, -1, 0)
    entries = (
        w * a - x * b - y * c - z * d,
        w * b + x * a + y * d - z * c,
        w * c - x * d + y * a + z * b,
        w * d + x * c - y * b + z * a,
    )
    return np.stack(entries, axis=-1)


def inverse(quaternion: Array) -> Array:
    """(..., 4) the inverse rotation."""
    return quaternion * np.array([1.0, -1.0, -1.0, -1.0])


def rotated(quaternion: Array, vector: Array) -> Array:
    """(..., 3) vectors (..., 3) after the rotation."""
    w, x, y, z = np.moveaxis(quaternion, -1, 0)
    a, b, c = np.moveaxis(vector, -1, 0)
    p, q, r = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    entries = (a + w * p + y * r - z * q, b + w * q + z * p - x * r, c + w * r + x * q - y * p)
    return np.stack(entries, axis=-1)


def about(axis: Array, angle: Array) -> Array:
    """(..., 4) rotations by angles (...) in rad about a unit axis (3,)."""
    half = np.asarray(angle)[..., None] / 2.0
    return np.concatenate([np.cos(half), np.sin(half) * axis], axis=-1)


def twist(quaternion: Array, axis: Array) -> Array:
    """(...) angle in rad of the twist of a rotation about a unit axis (3,).

    Swing-twist decomposition: the other factor rotates about an axis perpendicular to this one.
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
