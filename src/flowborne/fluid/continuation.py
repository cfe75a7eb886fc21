"""Values continued a few layers into places where the fluid is not."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flowborne.fluid.grid import Array
from flowborne.kernels.jit import kernel

LAYERS = 3
"""Layers that are filled: as far as a body's side can move in a step, and one more."""


@kernel
def inside(values: NDArray[np.uint8], i: int, j: int, k: int) -> bool:
    """Whether there is an entry at these indices."""
    ni, nj, nk = values.shape
    return 0 <= i < ni and 0 <= j < nj and 0 <= k < nk


@kernel
def gentler(a: float, b: float) -> float:
    """The smaller of two slopes, 0 where they disagree in sign."""
    if a * b <= 0.0:
        return 0.0
    return a if abs(a) < abs(b) else b


@kernel
def continue_into(values: Array, valid: NDArray[np.uint8], layers: int) -> None:
    """Fill invalid entries, layer by layer, along the lines through their known neighbours.

    Each known direct neighbour and the one behind it make a line (a neighbour alone is taken as it
    is), no steeper than between the two behind, and the entry becomes the mean of what these lines
    give there. Entries farther than
    `layers` from a valid one keep their value. `valid` is not changed.
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
                    for side in range(6):
                        step = 1 if side % 2 else -1
                        di = step if side // 2 == 0 else 0
                        dj = step if side // 2 == 1 else 0
                        dk = step if side // 2 == 2 else 0
                        a, b, c = i + di, j + dj, k + dk
                        if not (inside(known, a, b, c) and 0 < known[a, b, c] < layer):
                            continue
                        value = values[a, b, c]
                        d, e, f = a + di, b + dj, c + dk
                        if inside(known, d, e, f) and 0 < known[d, e, f] < layer:
                            slope = value - values[d, e, f]
                            g, m, n = d + di, e + dj, f + dk
                            if inside(known, g, m, n) and 0 < known[g, m, n] < layer:
                                slope = gentler(slope, values[d, e, f] - values[g, m, n])
                            value += slope
                        total, count = total + value, count + 1
                    if count:
                        values[i, j, k] = total / count
                        known[i, j, k] = layer
