"""Weighted sums over the layers of a field."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from flowborne.kernels.arrays import Array

Complex = NDArray[np.complex128]


@njit(nogil=True, cache=True)
def sum_layers(out: Complex, layers: Complex, weights: Array, at: int) -> None:
    """Sum of the layers (n, m), each times the weights (k, m) of its distance from the layer `at`.

    NumPy:  out[:] = sum(weights[abs(i - at)] * layers[i] for i in range(n))
    """
    out[:] = 0.0
    for i in range(layers.shape[0]):
        layer, weight = layers[i], weights[abs(i - at)]
        for k in range(out.size):
            out[k] += weight[k] * layer[k]
