"""The kernels of `orphans` in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flowborne.kernels.aggregates import OWN, WEAK
from flowborne.kernels.arrays import Array, Indices, Integers, Marks, Periodic, Real, Triple

from ..padded import cells_of


def neighbours_reference(
    cells: Integers, shape: Integers, periodic: Periodic
) -> Iterator[tuple[int, int, Integers]]:
    """Padded flat indices of the cells beyond each face of some cells; -1 outside.

    yields  axis, 0 for the lower and 1 for the upper face, indices
    """
    place = np.stack(np.unravel_index(cells, tuple(shape)))
    for axis in range(3):
        if shape[axis] > 1:
            inner = shape[axis] - 2
            for up in range(2):
                beyond = place.copy()
                beyond[axis] += 2 * up - 1
                outside = (beyond[axis] < 1) | (beyond[axis] > inner)
                beyond[axis] = (beyond[axis] - 1) % inner + 1
                found = np.ravel_multi_index(tuple(beyond), tuple(shape))
                yield axis, up, np.where(outside & (not periodic[axis]), -1, found)


def cover_reference(
    cells: Integers, shape: Integers, factor: Integers, coarse_shape: Integers
) -> Integers:
    """`cover` of several cells in NumPy."""
    place = np.stack(np.unravel_index(cells, tuple(shape)))
    ghost = (shape > 1).astype(np.int64)[:, None]
    over = (place - ghost) // factor[:, None] + ghost
    return np.asarray(np.ravel_multi_index(tuple(over), tuple(coarse_shape)))


def assign_orphans_reference(
    marks: Marks,
    w: Triple,
    inverse: Real,
    factor: Integers,
    periodic: Periodic,
    coarse_shape: Integers,
) -> tuple[Integers, Integers]:
    """`assign_orphans` in NumPy: the orphans, and the aggregate of each."""
    shape, flat, share = np.array(marks.shape), marks.ravel(), inverse.ravel()
    inside = np.zeros(marks.shape, bool)
    inside[cells_of(marks)] = True
    lost = np.flatnonzero(inside.ravel() & (flat < OWN) & (share > 0.0))
    weights, others = [], []
    for axis, up, other in neighbours_reference(lost, shape, periodic):
        step = up * int(np.prod(shape[axis + 1 :]))
        kept = (other >= 0) & (flat[other] >= OWN)
        weights.append(np.where(kept, w[axis].ravel()[lost + step], 0.0))
        others.append(other)
    best = np.argmax(weights, axis=0)
    along = np.arange(lost.size)
    found = np.array(weights)[best, along] > WEAK / share[lost]
    return lost[found], cover_reference(
        np.array(others)[best, along][found], shape, factor, coarse_shape
    )


def add_orphan_weights_reference(
    marks: Marks,
    w: Triple,
    coarse: Triple,
    factor: Integers,
    ratio: Array,
    periodic: Periodic,
    orphans: Indices,
    aggregates: Indices,
) -> Triple:
    """`add_orphan_weights` in NumPy: the coarse weights after it."""
    shape, wide = np.array(marks.shape), np.array(coarse[0].shape)
    out = coarse[0].copy(), coarse[1].copy(), coarse[2].copy()
    aggregate, flat = aggregates.ravel(), marks.ravel()
    at = orphans.astype(np.int64)
    for axis, up, other in neighbours_reference(at, shape, periodic):
        weight = w[axis].ravel()[at + up * int(np.prod(shape[axis + 1 :]))]
        orphan = (other >= 0) & (aggregate[other] > 0)
        counts = (other >= 0) & np.where(orphan, other > at, flat[other] >= OWN)
        own = np.where(counts & ~orphan, other, at)
        there = np.where(orphan, aggregate[other], cover_reference(own, shape, factor, wide))
        ends = np.stack([np.minimum(aggregate[at], there), np.maximum(aggregate[at], there)])
        low, high = (np.stack(np.unravel_index(end, tuple(wide))) for end in ends)
        for d in range(3):
            level = np.all(np.delete(low, d, 0) == np.delete(high, d, 0), axis=0) & counts
            n = wide[d] - 2
            across = np.where(level, high[d] - low[d], 0)
            inner = across == 1
            np.add.at(out[d], tuple(high[:, inner]), (weight * ratio[d][high[d] - 1])[inner])
            around = (across == n - 1) & (n > 2) & bool(periodic[d])
            np.add.at(out[d], tuple(low[:, around]), (weight * ratio[d][0])[around])
            high[d] += 1
            np.add.at(out[d], tuple(high[:, around]), (weight * ratio[d][n])[around])
            high[d] -= 1
    return out
