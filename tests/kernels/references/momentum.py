"""The kernels of `momentum` in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Mask
from flowborne.kernels.momentum import OF_THE_WHOLE, ROUNDING, Momenta


def about_origin_reference(vector: Array, moment: Array, centre: Array) -> Array:
    """`about_origin` in NumPy."""
    return np.concatenate([vector, moment + np.cross(centre, vector)], axis=1)


def momentum_impulse_reference(
    twist: Array,
    momenta: Momenta,
    conserved: Mask,
    gained: Array,
    still: Array,
    bias: Array,
    outer: Array,
    dt: float,
) -> tuple[Array, Array]:
    """`momentum_impulse` in NumPy."""
    given, later, body = momenta
    change = gained + (twist * (given - later)[body]).sum(axis=1)
    impulse = still + np.where(conserved, change, -dt * bias) + dt * outer
    scale = (np.abs(twist) * (np.abs(given) + np.abs(later))[body]).sum(axis=1)
    room = ROUNDING * (scale + dt * np.abs(outer)) + OF_THE_WHOLE * scale.max(initial=0.0)
    return impulse, room
