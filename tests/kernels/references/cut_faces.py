"""The kernels of `cut_faces` in NumPy, where no crossing is known."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array


def open_edge_reference(a: Array, b: Array) -> Array:
    """`open_edge` in NumPy."""
    apart = (a >= 0.0) != (b >= 0.0)
    part = np.divide(np.maximum(a, b), np.abs(a - b), out=np.zeros(a.shape), where=apart)
    return np.where(apart, part, a >= 0.0)


def closed_polygon_reference(corners: Array) -> tuple[Array, Array, Array]:
    """Closed part of unit squares with corner distances (4, ...), and its moments about their
    centres: the shoelace formula over all corners and cuts, those that are not there left out."""
    place = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    points, there = [], []
    for n in range(4):
        m = (n + 1) % 4
        apart = (corners[n] >= 0.0) != (corners[m] >= 0.0)
        t = np.divide(corners[n], corners[n] - corners[m], np.zeros(apart.shape), where=apart)
        points += [
            place[n] + np.zeros((*apart.shape, 2)),
            place[n] + t[..., None] * (place[m] - place[n]),
        ]
        there += [corners[n] < 0.0, apart]
    area, first = np.zeros(corners[0].shape), np.zeros((*corners[0].shape, 2))
    for point, is_one in zip(points[::-1], there[::-1], strict=True):
        first = np.where(is_one[..., None], point, first)
    moment, last = np.zeros_like(first), first
    for point, is_one in zip([*points, first], [*there, np.ones_like(there[0])], strict=True):
        cross = last[..., 0] * point[..., 1] - point[..., 0] * last[..., 1]
        cross = np.where(is_one, cross, 0.0)
        area += 0.5 * cross
        moment += cross[..., None] * (last + point) / 6.0
        last = np.where(is_one[..., None], point, last)
    return area, moment[..., 0], moment[..., 1]
