"""The kernels of `pressure_gradient` in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flowborne.kernels.arrays import CLOSED, OPEN, PERIODIC, Array


def subtract_gradient_reference(
    velocity: Array, rate: Array, pressure: Array, axis: int, scale: float, codes: NDArray[np.int64]
) -> Array:
    """`subtract_gradient` in NumPy: the velocity after it.

    Beyond a closed side lies the pressure inside, beyond an open one none.
    """
    p = np.moveaxis(pressure, axis, 0)
    low = {CLOSED: p[:1], OPEN: 0.0 * p[:1], PERIODIC: p[-1:]}[int(codes[axis, 0])]
    high = {CLOSED: p[-1:], OPEN: 0.0 * p[-1:], PERIODIC: p[:1]}[int(codes[axis, 1])]
    difference = np.moveaxis(np.diff(np.concatenate([low, p, high]), axis=0), 0, axis)
    return velocity - scale * rate * difference
