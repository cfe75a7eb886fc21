"""Values continued a few layers into places where the fluid is not."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flowborne.fluid.grid import Array
from flowborne.fluid.jit import kernel

LAYERS = 3
"""Layers that are filled: as far as a body's side can move in a step, and one more."""


@kernel
def continue_into(values: Array, valid: NDArray[np.uint8], layers: int) -> None:
    """Fill invalid entries, layer by layer, with the mean of their known direct neighbours.

    Entries farther than `layers` from a valid one keep their value. `valid` is not changed.
    """
    ni, nj, nk = values.shape
    known = valid.copy()
    for layer in range(2, layers + 2):
        for i in range(ni):
            for j in range(nj):
                for k in range(nk):
                    if known[i, j, k]:
                        continue
                    total, count = 0.0, 0
                    if i > 0 and 0 < known[i - 1, j, k] < layer:
                        total, count = total + values[i - 1, j, k], count + 1
                    if i < ni - 1 and 0 < known[i + 1, j, k] < layer:
                        total, count = total + values[i + 1, j, k], count + 1
                    if j > 0 and 0 < known[i, j - 1, k] < layer:
                        total, count = total + values[i, j - 1, k], count + 1
                    if j < nj - 1 and 0 < known[i, j + 1, k] < layer:
                        total, count = total + values[i, j + 1, k], count + 1
                    if k > 0 and 0 < known[i, j, k - 1] < layer:
                        total, count = total + values[i, j, k - 1], count + 1
                    if k < nk - 1 and 0 < known[i, j, k + 1] < layer:
                        total, count = total + values[i, j, k + 1], count + 1
                    if count:
                        values[i, j, k] = total / count
                        known[i, j, k] = layer
