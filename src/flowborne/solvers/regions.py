"""Null vectors of K + J A^-1 J^T: constants in the connected regions of the domain.

In a region without an open side K knows the unknown only up to a constant. A sum of such constants,
c_r in region r, is a null vector when A^-1 is 0 on the load  J^T (sum of c_r 1_r).
"""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Labels
from flowborne.kernels.regions import NULL
from flowborne.solvers.mobility import Mobility


def null_basis(count: Labels, loads: Array, mobility: Mobility) -> Array:
    """(regions, q) constants per region of an orthonormal basis of the operator's null space.

    count     (regions,) cells of each region without an open side
    loads     (regions, k) J^T 1_r of each region
    mobility  A^-1

    A region whose load has no response is a null vector of its own. Among the others, combinations
    c with  c^T F c = 0  for F_rs = (J^T 1_r)^T A^-1 (J^T 1_s) are: of two regions whose loads are
    opposite, only the constant that both share.
    """
    scale = 1.0 / np.sqrt(count)
    answers = mobility.times(loads)
    strength = np.einsum("rk,rk->r", answers, loads) * scale**2
    largest = mobility.largest() * np.square(loads * scale[:, None]).max(initial=0)
    held = strength > NULL * largest
    free = np.flatnonzero(~held)
    basis = np.zeros((count.size, free.size))
    basis[free, np.arange(free.size)] = scale[free]
    if not held.any():
        return basis
    scaled = loads[held] * scale[held, None]
    energy, vectors = np.linalg.eigh(mobility.times(scaled) @ scaled.T)
    null = vectors[:, energy < NULL * energy[-1]]
    joint = np.zeros((count.size, null.shape[1]))
    joint[held] = scale[held, None] * null
    return np.concatenate([basis, joint], axis=1)
