"""The kernels of `cholesky` in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Blocks


def lower_reference(value: Array, blocks: Blocks) -> Array:
    """(n, n) L of its blocks, dense."""
    first, below, rows, at, owner = blocks
    L = np.zeros((owner.size, owner.size))
    for s in range(first.size - 1):
        columns, shared = np.arange(first[s], first[s + 1]), rows[below[s] : below[s + 1]]
        w = columns.size
        own = value[at[s] : at[s] + w * w].reshape(w, w)
        L[np.ix_(columns, columns)] = np.tril(own.T)
        L[np.ix_(shared, columns)] = value[at[s] + w * w : at[s + 1]].reshape(w, -1).T
    return L
