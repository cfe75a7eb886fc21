"""The kernels for viscous links in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Integers


def apply_component_reference(x: Array, scale: Array, links: Array, wraps: Integers) -> Array:
    """`apply_component` in NumPy."""
    scaled = (scale * x).reshape(links.shape[1:])
    pull = np.zeros(scaled.shape)
    for d in range(3):
        faces = int(wraps[d]) or scaled.shape[d]
        k, y, total = (np.moveaxis(values, d, 0)[:faces] for values in (links[d], scaled, pull))
        total += k * np.roll(y, -1, axis=0) + np.roll(k * y, 1, axis=0)
    return x - scale * pull.ravel()
