"""Connected regions of the fluid, and the pressures that push nothing.

A region without an open side holds its pressure only up to a constant. A sum of such constants,
c_r in region r, is a null vector of  K + G^T M G  when the wrench G (sum of c_r 1_r) moves no body.
"""

from __future__ import annotations

import numpy as np

from flowborne.fluid.grid import Array
from flowborne.fluid.response import Response
from flowborne.kernels.arrays import Labels
from flowborne.kernels.regions import NULL


def null_basis(count: Labels, wrench: Array, response: Response) -> Array:
    """(regions, q) constants per region of an orthonormal basis of the operator's null space.

    count     (regions,) cells of each region without an open side
    wrench    (regions, k) G 1_r of each region
    response  M

    A region that pushes no movable body is a null vector of its own. Among the others, combinations
    c with  c^T F c = 0  for F = (G 1_r)^T M (G 1_s) are: with a plug between two cavities, only the
    constant that both share.
    """
    scale = 1.0 / np.sqrt(count)
    moved = response.times(wrench)
    strength = np.einsum("rk,rk->r", moved, wrench) * scale**2
    largest = response.largest() * np.square(wrench * scale[:, None]).max(initial=0)
    held = strength > NULL * largest
    free = np.flatnonzero(~held)
    basis = np.zeros((count.size, free.size))
    basis[free, np.arange(free.size)] = scale[free]
    if not held.any():
        return basis
    scaled = wrench[held] * scale[held, None]
    energy, vectors = np.linalg.eigh(response.times(scaled) @ scaled.T)
    null = vectors[:, energy < NULL * energy[-1]]
    joint = np.zeros((count.size, null.shape[1]))
    joint[held] = scale[held, None] * null
    return np.concatenate([basis, joint], axis=1)
