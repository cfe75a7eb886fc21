"""Which coarse cell stands for each fine cell.

Usually the one that covers it. But a thin plate may cut the fine cells under one coarse cell into
parts that do not touch, and a coarse cell that stood for both sides would let pressure leak through
the plate on every coarser level. So the largest part keeps the coarse cell, and a fine cell of the
others goes with its neighbour beyond the coarse cell's side, if that one kept its own; it is then
called a orphan there. Fine cells that find no such neighbour are left to the smoother.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from flowborne.kernels.arrays import Array, Indices, Integers, Marks, Periodic, Real, Triple
from flowborne.kernels.control_volumes import stride
from flowborne.kernels.jit import kernel

OWN = 8
"""Mark of a fine cell that belongs to the coarse cell over it; marks 1, 2 and 4 besides: it may
also interpolate from the next coarse cell along that axis. Ghosts are marked as well."""

CUT, ACTIVE = 1, 2
"""What there is among the fine cells under a coarse one: cells that do not touch, active cells."""

WEAK = 0.02
"""Cells are taken as touching when the face between them has more than this share of the sum of
face weights of one of them."""


@kernel
def mark_own(marks: Marks, w: Triple, inverse: Real, factor: Integers) -> None:
    """Mark the largest connected part of the fine cells under each coarse cell as OWN.

    factor  fine cells in a coarse one along each axis, 1 or 2
    """
    w0, w1, w2 = w
    f0, f1, f2 = factor
    d = 1 if inverse.shape[0] > 1 else 0
    n0, n1, n2 = inverse.shape[0] - 2 * d, inverse.shape[1] - 2, inverse.shape[2] - 2
    blocks = (n0 + f0 - 1) // f0
    for block in prange(blocks):
        state = np.empty(n2 + 2, np.uint8)
        first0 = f0 * block + d
        end0 = min(first0 + f0, n0 + d)
        for first1 in range(1, n1 + 1, f1):
            end1 = min(first1 + f1, n1 + 1)
            state[:] = 0
            for i in range(first0, end0):
                for j in range(first1, end1):
                    for k in range(1, n2 + 1):
                        share = inverse[i, j, k]
                        whole = (i == first0) | (w0[i, j, k] * share > WEAK)
                        whole &= (j == first1) | (w1[i, j, k] * share > WEAK)
                        whole &= ((k - 1) & (f2 - 1) == 0) | (w2[i, j, k] * share > WEAK)
                        active = share > 0.0
                        state[k] |= (0 if whole & active else CUT) | (ACTIVE if active else 0)
                        marks[i, j, k] = OWN if active else 0
            for first2 in range(1, n2 + 1, f2):
                end2 = min(first2 + f2, n2 + 1)
                if state[first2] | state[end2 - 1] == CUT | ACTIVE:
                    mark_largest(marks, w, inverse, (first0, first1, first2), (end0, end1, end2))


@kernel
def mark_largest(
    marks: Marks, w: Triple, inverse: Real, first: tuple[int, int, int], end: tuple[int, int, int]
) -> None:
    """Mark the largest connected part of at most 2 x 2 x 2 cells as OWN, the others as 0."""
    part, size = np.full(8, -1), np.zeros(8, np.int64)
    for i in range(first[0], end[0]):
        for j in range(first[1], end[1]):
            for k in range(first[2], end[2]):
                if inverse[i, j, k] > 0.0:
                    n = 4 * (i - first[0]) + 2 * (j - first[1]) + k - first[2]
                    part[n] = n
    changed = True
    while changed:
        changed = False
        for n in range(8):
            i, j, k = first[0] + (n >> 2), first[1] + ((n >> 1) & 1), first[2] + (n & 1)
            for axis in range(3):
                m = n ^ (4 >> axis)
                if m > n or part[n] < 0 or part[m] < 0 or part[n] == part[m]:
                    continue
                below = i - int(axis == 0), j - int(axis == 1), k - int(axis == 2)
                if w[axis][i, j, k] * max(inverse[i, j, k], inverse[below]) > WEAK:
                    part[n] = part[m] = min(part[n], part[m])
                    changed = True
    for n in range(8):
        if part[n] >= 0:
            size[part[n]] += 1
    best = 0
    for n in range(1, 8):
        if size[n] > size[best]:
            best = n
    for i in range(first[0], end[0]):
        for j in range(first[1], end[1]):
            for k in range(first[2], end[2]):
                n = 4 * (i - first[0]) + 2 * (j - first[1]) + k - first[2]
                marks[i, j, k] = OWN if part[n] == best else 0


@kernel
def mark_interpolated(marks: Marks, w: Triple, inverse: Real, interpolation: Triple) -> None:
    """Add 1, 2, 4 where the cell towards the next coarse cell along an axis touches and is OWN.

    Beyond an open side pressure is 0, and that is interpolated from as well.
    """
    w0, w1, w2 = w
    towards0, towards1, towards2 = interpolation
    d = 1 if marks.shape[0] > 1 else 0
    p2 = marks.shape[2]
    for plane in prange(marks.shape[0] - 2 * d):
        i = plane + d
        s0 = 1 if towards0[plane + 1] > 0.0 else 0
        next0 = i + d * (2 * s0 - 1)
        row = np.empty(p2, marks.dtype)
        for j in range(1, marks.shape[1] - 1):
            s1 = 1 if towards1[j] > 0.0 else 0
            next1 = j + 2 * s1 - 1
            for k in range(1, p2 - 1):
                share = inverse[i, j, k]
                up = towards2[k] > 0.0
                weight = w2[i, j, k + 1] if up else w2[i, j, k]
                beyond = marks[i, j, k + 1] if up else marks[i, j, k - 1]
                mark = 4 if (weight * share > WEAK) & (beyond >= OWN) else 0
                if (w1[i, j + s1, k] * share > WEAK) & (marks[i, next1, k] >= OWN):
                    mark += 2
                if (w0[i + s0 * d, j, k] * share > WEAK) & (marks[next0, j, k] >= OWN):
                    mark += d
                row[k] = mark + OWN if marks[i, j, k] >= OWN else 0
            for k in range(1, p2 - 1):
                marks[i, j, k] = row[k]


@kernel
def neighbour(at: int, axis: int, up: int, shape: Integers, periodic: Periodic) -> int:
    """Padded flat index of the cell beyond a face, around a periodic axis; -1 outside.

    up     0: lower face, 1: upper face
    shape  of the padded array
    """
    step, inner, way = stride(shape, axis), shape[axis] - 2, 2 * up - 1
    if (at // step) % shape[axis] == (inner if up else 1):
        return at - way * (inner - 1) * step if periodic[axis] else -1
    return at + way * step


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
    return float(w[axis].reshape(-1)[at + up * stride(shape, axis)])


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
    ratio      (3, most faces) of distances for each coarse face, see `levels.distance_ratio`
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
    coarse: Triple, shape: Integers, a: int, b: int, weight: float, ratio: Array, periodic: Periodic
) -> None:
    """Add a fine weight to the coarse face between two coarse cells, if they share one."""
    low, high = min(a, b), max(a, b)
    for axis in range(3):
        step, inner = stride(shape, axis), shape[axis] - 2
        place = (high // step) % shape[axis]
        w = coarse[axis].reshape(-1)
        if high - low == step and place > 1:
            w[high] += weight * ratio[axis, place - 1]
            return
        if periodic[axis] and high - low == (inner - 1) * step and place == inner:
            w[low] += weight * ratio[axis, 0]
            w[high + step] += weight * ratio[axis, inner]
            return
