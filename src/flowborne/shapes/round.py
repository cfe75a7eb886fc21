"""Surfaces of revolution: profiles that rotate about z."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Integers
from flowborne.shapes.section import ALIGNED_SINE, Section, chord
from flowborne.shapes.thickness import split_quads

ARC = 32
"""Patches around a circle, and sides of a drawn circle."""


def parts(length: float, longest: float) -> int:
    """Number of equal parts of a length, none above `longest`."""
    return max(int(np.ceil(length / longest - 1e-9)), 1)


def capsule_profile(radius: float, half_length: float, longest: float, arc: int) -> Array:
    """(k, 2) distance from the axis and height, from pole to pole of a capsule or sphere.

    longest  largest part of the straight side, m
    arc      parts of a full circle
    """
    angle = np.linspace(-0.5 * np.pi, 0.0, arc // 4 + 1)
    below = np.stack([radius * np.cos(angle), radius * np.sin(angle) - half_length], axis=1)
    below[0, 0] = 0.0
    above = below[::-1] * [1.0, -1.0]
    if half_length == 0.0:
        return np.concatenate([below, above[1:]])
    rise = np.linspace(-half_length, half_length, parts(2.0 * half_length, longest) + 1)[1:-1]
    return np.concatenate([below, np.stack([np.full(rise.size, radius), rise], axis=1), above])


def cylinder_profile(radius: float, half_length: float, longest: float) -> Array:
    """(k, 2) as `capsule_profile`, for a cylinder; no part is above `longest` m."""
    rise = np.linspace(-half_length, half_length, parts(2.0 * half_length, longest) + 1)
    disc = np.linspace(0.0, radius, parts(radius, longest) + 1)[:-1]
    return np.concatenate(
        [
            np.stack([disc, np.full(disc.size, -half_length)], axis=1),
            np.stack([np.full(rise.size, radius), rise], axis=1),
            np.stack([disc[::-1], np.full(disc.size, half_length)], axis=1),
        ]
    )


def revolved(profile: Array, scale: Array | float = 1.0) -> tuple[Array, Array]:
    """Patches (see `Shape.patches`) of a profile rotated about z, scaled by `scale` (3,)."""
    angle = 2.0 * np.pi * np.arange(ARC + 1) / ARC
    angle[-1] = 0.0
    points = np.empty((len(profile), ARC + 1, 3))
    points[..., 0] = profile[:, :1] * np.cos(angle)
    points[..., 1] = profile[:, :1] * np.sin(angle)
    points[..., 2] = profile[:, 1:]
    points *= scale
    a, b, c, d = points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]
    return _quads(a.reshape(-1, 3), b.reshape(-1, 3), c.reshape(-1, 3), d.reshape(-1, 3))


def _quads(a: Array, b: Array, c: Array, d: Array) -> tuple[Array, Array]:
    """Centroids and area vectors of plane quadrangles given by their corners in order."""
    first, second = 0.5 * np.cross(b - a, c - a), 0.5 * np.cross(c - a, d - a)
    vector = first + second
    weight = np.linalg.norm(first, axis=1), np.linalg.norm(second, axis=1)
    total = np.maximum(weight[0] + weight[1], np.finfo(float).tiny)
    share = (weight[1] / total)[:, None]
    return (a + c + (1.0 - share) * b + share * d) / 3.0, vector


def swept_triangles(profile: Array, scale: Array | float = 1.0) -> tuple[Array, Integers]:
    """Closed surface of a profile from pole to pole, rotated about z, scaled by `scale` (3,)."""
    angle = 2.0 * np.pi * np.arange(ARC) / ARC
    radius, height = profile[1:-1].T
    rings = np.empty((len(radius), ARC, 3))
    rings[..., 0] = radius[:, None] * np.cos(angle)
    rings[..., 1] = radius[:, None] * np.sin(angle)
    rings[..., 2] = height[:, None]
    poles = np.array([[0.0, 0.0, profile[0, 1]], [0.0, 0.0, profile[-1, 1]]])
    number = np.arange(len(radius) * ARC).reshape(-1, ARC)
    next_one = np.roll(number, -1, axis=1)
    a, b, c, d = number[:-1], next_one[:-1], next_one[1:], number[1:]
    low, high = np.full(ARC, rings.size // 3), np.full(ARC, rings.size // 3 + 1)
    faces = [
        np.stack([low, next_one[0], number[0]], axis=1),
        split_quads(a.ravel(), b.ravel(), c.ravel(), d.ravel()),
        np.stack([high, number[-1], next_one[-1]], axis=1),
    ]
    return np.concatenate([rings.reshape(-1, 3), poles]) * scale, np.concatenate(faces)


def section_of_rod(family: str, size: Array, z: Array, height: float) -> Section:
    """Cross-section of a rod about its local z: a disc if upright, `family` if lying.

    size  (3,) radius first, half length second, m
    z     (3,) the world's z in its frame
    """
    radius, half_length = float(size[0]), float(size[1])
    foot = -height * z
    if np.hypot(z[0], z[1]) <= ALIGNED_SINE:
        beyond = max(abs(height) - half_length, 0.0)
        if family == "rectangle" and beyond > 0.0:
            raise ValueError("misses the plane z = 0")
        cut = chord(radius, beyond)
        axes = np.array([[1.0, 0.0, 0.0], [0.0, np.sign(z[2]), 0.0]])
        return Section("ellipse", (cut, cut), foot, axes)
    if abs(z[2]) > ALIGNED_SINE:
        raise ValueError("has no local axis along z")
    cut = chord(radius, height)
    along = np.array([0.0, 0.0, 1.0])
    return Section(family, (half_length, cut), foot, np.stack([along, np.cross(z, along)]))
