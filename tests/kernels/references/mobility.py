"""The kernels of `mobility` in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, MobilityArrays

from .cholesky import lower_reference


def respond_reference(load: Array, mobility: MobilityArrays) -> Array:
    """`respond` in NumPy, by dense matrices."""
    dense, t_start, t_column, t_value, value, blocks, order, taken = mobility
    if t_start.size == 1:
        return np.asarray(dense @ load)
    T, L = np.zeros((load.size, order.size)), lower_reference(value, blocks)
    np.add.at(T, (np.repeat(np.arange(load.size), np.diff(t_start)), t_column), t_value)
    factored = (L @ L.T)[np.ix_(order, order)]
    return np.asarray(T @ (np.linalg.inv(factored) - taken @ taken.T) @ T.T @ load)
