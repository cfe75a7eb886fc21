"""The kernels of `pressure_gradient` in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import FREE, PERIODIC, PRESCRIBED, Array


def subtract_gradient_reference(
    velocity: Array, rate: Array, pressure: Array, axis: int, scale: float, ends: tuple[int, int]
) -> Array:
    """`subtract_gradient` in NumPy: the velocity after it.

    Beyond a side that prescribes the flux lies the pressure inside, beyond a free one none.

    ends  a of the velocity across the lower and upper side
    """
    p = np.moveaxis(pressure, axis, 0)
    low = {PRESCRIBED: p[:1], FREE: 0.0 * p[:1], PERIODIC: p[-1:]}[ends[0]]
    high = {PRESCRIBED: p[-1:], FREE: 0.0 * p[-1:], PERIODIC: p[:1]}[ends[1]]
    difference = np.moveaxis(np.diff(np.concatenate([low, p, high]), axis=0), 0, axis)
    return velocity - scale * rate * difference
