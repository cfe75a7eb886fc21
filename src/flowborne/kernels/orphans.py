"""Fine cells that go with another coarse cell than the one over them (see `aggregates`)."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.aggregates import OWN, WEAK
from flowborne.kernels.arrays import Array, Indices, Integers, Marks, Periodic, Real, Triple
from flowborne.kernels.jit import kernel


@kernel
def neighbour(at: int, axis: int, up: int, shape: Integers, periodic: Periodic) -> int:
    """Padded flat index of the cell beyond a face, around a periodic axis; -1 outside.

    up     0: lower face, 1: upper face
    shape  of the padded array
    """
    stride = shape[2] if axis == 1 else (1 if axis == 2 else shape[1] * shape[2])
    place = (at // stride) % shape[axis]
    inner = shape[axis] - 2
    if up and place == inner:
        return at - (inner - 1) * stride if periodic[axis] else -1
    if not up and place == 1:
        return at + (inner - 1) * stride if periodic[axis] else -1
    return at + (2 * up - 1) * stride


@kernel
def cover(at: int, shape: Integers, factor: Integers, coarse_shape: Integers) -> int:
    """Padded flat index of the coarse cell over a fine cell."""
    d = 1 if shape[0] > 1 else 0
    i, j, k = at // (shape[1] * shape[2]), (at // shape[2]) % shape[1], at % shape[2]
    c0 = (i - d) // factor[0] + d
    c1, c2 = (j - 1) // factor[1] + 1, (k - 1) // factor[2] + 1
    return int((c0 * coarse_shape[1] + c1) * coarse_shape[2] + c2)


@kernel
def face_of(w: Triple, shape: Integers, axis: int, at: int, up: int) -> float:
    """Weight of the lower or upper face of a cell."""
    if axis == 0:
        return float(w[0].reshape(-1)[at + up * shape[1] * shape[2]])
    if axis == 1:
        return float(w[1].reshape(-1)[at + up * shape[2]])
    return float(w[2].reshape(-1)[at + up])


@kernel
def assign_orphans(
    marks: Marks,
    w: Triple,
    inverse: Real,
    factor: Integers,
    periodic: Periodic,
    coarse_shape: Integers,
    orphans: Indices,
    aggregates: Indices,
) -> int:
    """Find a coarse cell for the fine cells that lost their own; returns how many found one.

    coarse_shape  of the padded coarse arrays
    orphans        filled with the padded flat fine cells
    aggregates         padded over the fine level: flat coarse cell of each orphan, 0 elsewhere
    """
    p0, p1, p2 = marks.shape
    shape = np.array([p0, p1, p2])
    d = 1 if p0 > 1 else 0
    flat, share, aggregate = marks.reshape(-1), inverse.reshape(-1), aggregates.reshape(-1)
    count = 0
    for i in range(d, p0 - d):
        for j in range(1, p1 - 1):
            lost = 0
            for k in range(1, p2 - 1):
                aggregates[i, j, k] = 0
                lost += marks[i, j, k] < OWN
            for k in range(1, p2 - 1 if lost else 1):
                at = (i * p1 + j) * p2 + k
                if flat[at] & OWN or share[at] == 0.0:
                    continue
                best = WEAK / share[at]
                for axis in range(1 - d, 3):
                    for up in range(2):
                        other = neighbour(at, axis, up, shape, periodic)
                        if other < 0 or not flat[other] & OWN:
                            continue
                        weight = face_of(w, shape, axis, at, up)
                        if weight > best:
                            best = weight
                            aggregate[at] = cover(other, shape, factor, coarse_shape)
                if aggregate[at] > 0:
                    orphans[count] = at
                    count += 1
    return count


@kernel
def add_orphan_weights(
    marks: Marks,
    w: Triple,
    coarse: Triple,
    factor: Integers,
    ratio: Array,
    periodic: Periodic,
    orphans: Indices,
    aggregates: Indices,
) -> None:
    """Add the faces of orphans to the faces between their aggregates and the coarse cells beyond.

    w, coarse  padded weights of the fine and the coarse level
    ratio      (3, most faces) of distances for each coarse face, see `centres.distance_ratio`
    """
    shape, wide = np.array(marks.shape), np.array(coarse[0].shape)
    aggregate, flat = aggregates.reshape(-1), marks.reshape(-1)
    for g in range(orphans.size):
        at = orphans[g]
        for axis in range(1 if shape[0] == 1 else 0, 3):
            for up in range(2):
                weight = face_of(w, shape, axis, at, up)
                other = neighbour(at, axis, up, shape, periodic)
                if weight == 0.0 or other < 0:
                    continue
                if aggregate[other] > 0:
                    there = aggregate[other]
                    if other < at:
                        continue
                elif flat[other] & OWN:
                    there = cover(other, shape, factor, wide)
                else:
                    continue
                add_between(coarse, wide, aggregate[at], there, weight, ratio, periodic)


@kernel
def add_between(
    coarse: Triple,
    shape: Integers,
    a: int,
    b: int,
    weight: float,
    ratio: Array,
    periodic: Periodic,
) -> None:
    """Add a fine weight to the coarse face between two coarse cells, if they share one."""
    low, high = min(a, b), max(a, b)
    for axis in range(3):
        stride = shape[2] if axis == 1 else (1 if axis == 2 else shape[1] * shape[2])
        inner = shape[axis] - 2
        place = (high // stride) % shape[axis]
        w = coarse[axis].reshape(-1)
        if high - low == stride and place > 1:
            w[high] += weight * ratio[axis, place - 1]
            return
        if periodic[axis] and high - low == (inner - 1) * stride and place == inner:
            w[low] += weight * ratio[axis, 0]
            w[high + stride] += weight * ratio[axis, inner]
            return
