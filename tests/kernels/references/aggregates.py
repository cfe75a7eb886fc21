"""The kernels of `aggregates` in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.aggregates import OWN, WEAK
from flowborne.kernels.arrays import Integers, Marks, Real, Triple

from ..padded import cells_of


def mark_own_reference(w: Triple, inverse: Real, factor: Integers) -> Marks:
    """`mark_own` in NumPy: the marks of all cells, without ghosts."""
    from scipy.sparse import coo_array  # for this statement alone
    from scipy.sparse.csgraph import connected_components

    inside = cells_of(inverse)
    share = inverse[inside]
    active, number = share > 0.0, np.arange(share.size).reshape(share.shape)
    pairs, block = [], np.zeros(share.shape, np.int64)
    for axis in range(3):
        n = share.shape[axis]
        over = np.expand_dims(np.arange(n) // factor[axis], [d for d in range(3) if d != axis])
        block = block * n + over
        s, c, face = (np.moveaxis(a, axis, 0) for a in (share, number, w[axis][inside]))
        together = np.arange(1, n) % factor[axis] != 0
        touch = (face[1:] * np.maximum(s[1:], s[:-1]) > WEAK) & together[:, None, None]
        touch &= (s[1:] > 0.0) & (s[:-1] > 0.0)
        pairs.append(np.stack([c[1:][touch], c[:-1][touch]]))
    a, b = np.concatenate(pairs, axis=1)
    graph = coo_array((np.ones(a.size), (a, b)), shape=(share.size, share.size))
    part = connected_components(graph, directed=False)[1]
    _, first = np.unique(part, return_index=True)
    size = np.bincount(part) * active.ravel()[first]
    order = np.lexsort((first, -size, block.ravel()[first]))
    chosen = order[np.unique(block.ravel()[first][order], return_index=True)[1]]
    own = np.isin(part, chosen).reshape(share.shape) & active
    return np.where(own, OWN, 0).astype(np.uint8)


def mark_interpolated_reference(
    marks: Marks, w: Triple, inverse: Real, interpolation: Triple
) -> Marks:
    """`mark_interpolated` in NumPy: the marks after it."""
    inside, out = cells_of(marks), marks.copy()
    for axis in range(3):
        if marks.shape[axis] > 1:
            up = np.expand_dims(interpolation[axis] > 0.0, [d for d in range(3) if d != axis])
            face = np.where(up, np.roll(w[axis], -1, axis), w[axis])
            beyond = np.where(up, np.roll(marks, -1, axis), np.roll(marks, 1, axis))
            touches = (face * inverse > WEAK) & (beyond >= OWN) & (marks >= OWN)
            out[inside] += ((1 << axis) * touches[inside]).astype(np.uint8)
    out[inside] *= (marks >= OWN)[inside]
    return out
