"""Potentials of what induces velocity: of the layers of a field, and of a line of vorticity."""

from __future__ import annotations

import numpy as np
from numba import prange

from flowborne.kernels.arrays import Array, Complex
from flowborne.kernels.jit import kernel


@kernel
def wake_potential(
    out: Array, places: Array, middles: Array, circulation: Array, moment: Array
) -> None:
    """(1/4 pi) sum over bins of G/d + M.d/d^3 at places (n, 3), of one component.

    middles  (k, 3);  circulation  (k,) G;  moment  (k, 3) M
    """
    for n in prange(places.shape[0]):
        total = 0.0
        for k in range(middles.shape[0]):
            x, y = places[n, 0] - middles[k, 0], places[n, 1] - middles[k, 1]
            z = places[n, 2] - middles[k, 2]
            near = 1.0 / (x * x + y * y + z * z)
            arm = moment[k, 0] * x + moment[k, 1] * y + moment[k, 2] * z
            total += np.sqrt(near) * (circulation[k] + near * arm)
        out[n] = total / (4.0 * np.pi)


@kernel
def sum_layers(out: Complex, layers: Complex, weights: Array, at: int) -> None:
    """Sum of the layers (n, m), each times the weights (k, m) of its distance from the layer `at`.

    NumPy:  out[:] = sum(weights[abs(i - at)] * layers[i] for i in range(n))
    """
    out[:] = 0.0
    for i in range(layers.shape[0]):
        layer, weight = layers[i], weights[abs(i - at)]
        for k in range(out.size):
            out[k] += weight[k] * layer[k]
