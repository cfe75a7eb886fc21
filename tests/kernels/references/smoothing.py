"""The kernels of `smoothing` in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Real, Triple
from flowborne.kernels.smoothing import WEIGHTS

from ..padded import cells_of
from .laplacian import neighbour_sum


def smooth_reference(x: Real, b: Real, w: Triple, inverse: Real, step: int) -> Array:
    """`smooth` in NumPy: x after it, with its own ghosts."""
    inside, out = cells_of(x), np.array(x, np.float64)
    there = (b + neighbour_sum(x, w)) * inverse
    out[inside] += WEIGHTS[step] * (there - x)[inside]
    return out


def defect_reference(x: Real, b: Real, w: Triple, inverse: Real) -> Array:
    """`smooth` without a weight in NumPy, with ghosts 0."""
    r, inside = np.zeros(x.shape), cells_of(x)
    active = inverse > 0.0
    K_x = x / np.where(active, inverse, 1.0) - neighbour_sum(x, w)
    r[inside] = np.where(active, b - K_x, 0.0)[inside]
    return r
