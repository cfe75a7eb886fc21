"""The kernels of `thickness` in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Integers, Mask

from .triangles import closest_on_triangle_reference


def any_within_reference(
    places: Array, radius: float, vertices: Array, triangles: Integers
) -> Mask:
    """`any_within` in NumPy, every place with every triangle."""
    corners, found = vertices[triangles], np.zeros(len(places), np.bool_)
    for n, p in enumerate(places):
        closest = [closest_on_triangle_reference(p, one) @ one for one in corners]
        found[n] = np.linalg.norm(np.array(closest) - p, axis=1).min() <= radius
    return found


def way_inward_reference(vertices: Array, triangles: Integers) -> Array:
    """`way_inward` in NumPy, triangle by triangle through the plane of every other one."""
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    middle, inward = (a + b + c) / 3.0, np.cross(c - a, b - a)
    inward /= np.linalg.norm(inward, axis=1)[:, None]
    normal, way = np.cross(b - a, c - a), np.full(len(a), np.inf)
    for n in range(len(a)):
        with np.errstate(divide="ignore", invalid="ignore"):
            t = np.einsum("td,td->t", a - middle[n], normal) / (normal @ inward[n])
            hit = middle[n] + t[:, None] * inward[n]
        sides = [np.cross(q - p, hit - p) for p, q in ((a, b), (b, c), (c, a))]
        within = np.all([np.einsum("td,td->t", side, normal) >= 0.0 for side in sides], axis=0)
        within &= (t > 0.0) & (np.arange(len(a)) != n)
        way[n] = t[within].min(initial=np.inf)
    return way
