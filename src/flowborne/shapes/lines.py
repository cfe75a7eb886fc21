"""The part of parallel lines that lies inside simple solids."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def between(o: Array, d: Array, half: Array) -> tuple[Array, Array]:
    """Part of each line where |o + t d| <= half in every component."""
    enter, leave = np.full(len(o), -np.inf), np.full(len(o), np.inf)
    for k in range(o.shape[1]):
        if abs(d[k]) > 1e-12:
            ends = np.stack([-half[k] - o[:, k], half[k] - o[:, k]]) / d[k]
            enter = np.maximum(enter, ends.min(axis=0))
            leave = np.minimum(leave, ends.max(axis=0))
        else:
            enter = np.where(np.abs(o[:, k]) < half[k], enter, np.inf)
            leave = np.where(np.abs(o[:, k]) < half[k], leave, -np.inf)
    return enter, leave


def in_unit_ball(o: Array, d: Array) -> tuple[Array, Array]:
    """Part of each line where |o + t d| <= 1; all of it, or nothing, for d = 0."""
    a, b, c = float(d @ d), o @ d, (o * o).sum(axis=1) - 1.0
    if a < 1e-24:
        return np.where(c < 0.0, -np.inf, np.inf), np.where(c < 0.0, np.inf, -np.inf)
    root = b * b - a * c
    width = np.sqrt(np.maximum(root, 0.0))
    return (
        np.where(root > 0.0, (-b - width) / a, np.inf),
        np.where(root > 0.0, (-b + width) / a, -np.inf),
    )


def in_cylinder(o: Array, d: Array, size: Array) -> tuple[Array, Array]:
    """Part of each line in the cylinder of radius size[0] and half length size[1] about z."""
    enter, leave = in_unit_ball(o[:, :2] / size[0], d[:2] / size[0])
    low, high = between(o[:, 2:], d[2:], size[1:2])
    return np.maximum(enter, low), np.minimum(leave, high)
