"""The part of the preconditioner that takes the modes of a low-rank term off a V-cycle.

With Y = V B and C = (1 + B^T Y)^-1 R^T (see `solvers.deflation`) the preconditioned residual r is
V r - Y (C J^T V r).
"""

from __future__ import annotations

import numpy as np
from numba import prange

from flowborne.kernels.arrays import Array, Real, Rows
from flowborne.kernels.jit import kernel
from flowborne.kernels.sparse_rows import sum_rows


@kernel
def mode_strengths(z: Real, rows: Rows, amounts: Array, scale: float) -> Array:
    """(m,) C J^T z x scale for a padded field z = V r and amounts C (m, k)."""
    count, size = amounts.shape
    strength = np.zeros(count)
    if count:
        load = sum_rows(z, rows, size)
        for n in range(count):
            for c in range(size):
                strength[n] += amounts[n, c] * (scale * load[c])
    return strength


@kernel
def deflated(out: Array, z: Real, r: Array, scale: float, strength: Array, fields: Real) -> float:
    """out = scale z - Y strength in the cells; returns out . r.

    In double precision, because a compliant mode leaves very little of z where it acts.
    """
    d = 1 if z.shape[0] > 1 else 0
    planes, last = z.shape[0] - 2 * d, z.shape[2] - 1
    parts = np.zeros(planes)
    for i in prange(planes):
        m = i + d
        row = np.zeros(last + 1)
        for j in range(1, z.shape[1] - 1):
            for k in range(1, last):
                out[m, j, k] = scale * z[m, j, k]
            for n in range(strength.size):
                for k in range(1, last):
                    out[m, j, k] -= strength[n] * fields[n, m, j, k]
            for k in range(1, last):
                row[k] += out[m, j, k] * r[m, j, k]
        for k in range(1, last):
            parts[i] += row[k]
    total = 0.0
    for i in range(planes):
        total += parts[i]
    return total
