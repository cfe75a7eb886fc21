"""The links of the viscous system on a vector of faces."""

from __future__ import annotations

import numpy as np
from numba import prange

from flowborne.kernels.arrays import Array, Integers
from flowborne.kernels.jit import kernel


@kernel
def apply_component(out: Array, x: Array, scale: Array, links: Array, wraps: Integers) -> None:
    """out = x - scale sum of links (scale x) of the neighbours, for one component.

    wraps  (3,) number of distinct faces along each axis where the domain is periodic, else 0
    """
    _, ni, nj, nk = links.shape
    steps = nj * nk, nk, 1
    link = links.reshape(3, -1)
    for plane in prange(ni):
        i = np.int64(plane)
        for j in range(nj):
            for k in range(nk):
                f = i * steps[0] + j * steps[1] + k
                total = 0.0
                for d in range(3):
                    at = i if d == 0 else (j if d == 1 else k)
                    around = steps[d] * (wraps[d] - 1)
                    if link[d, f] != 0.0:
                        g = f - around if at + 1 == wraps[d] else f + steps[d]
                        total += link[d, f] * scale[g] * x[g]
                    if at != wraps[d]:
                        g = f - steps[d] if at > 0 else f + around
                        total += link[d, g] * scale[g] * x[g]
                out[f] = x[f] - scale[f] * total
