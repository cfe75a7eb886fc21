"""The kernels of `closed_fractions` in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import PERIODIC, PRESCRIBED, Array, Integers
from flowborne.kernels.closed_fractions import CREASE


def face_closed_reference(phi: Array, axis: int) -> Array:
    """`closed_face` of all faces across `axis` in NumPy, where no crossing is known.

    A corner alone on its side of the surface has a triangle of the square, two beside each other a
    trapezium. Two inside that face each other across a diagonal are joined.
    """
    p = np.moveaxis(phi, axis, 0)
    corner = np.stack([p[:, :-1, :-1], p[:, 1:, :-1], p[:, 1:, 1:], p[:, :-1, 1:]])
    inside, ways = corner < 0.0, []
    for step in (1, -1):
        other = np.roll(corner, step, axis=0)
        apart = inside != (other < 0.0)
        ways.append(np.divide(corner, corner - other, np.zeros_like(corner), where=apart))
    count, beside = inside.sum(axis=0), (inside[0] != inside[2])
    triangle, strip = 0.5 * ways[0] * ways[1], 0.5 * (ways[0] + ways[1])
    closed = np.where(count == 1, (triangle * inside).sum(axis=0), count == 4)
    closed = np.where((count == 2) & beside, (strip * inside).sum(axis=0), closed)
    joined = (count == 3) | ((count == 2) & ~beside)
    closed = np.where(joined, 1.0 - (triangle * ~inside).sum(axis=0), closed)
    return np.moveaxis(closed, 0, axis)


def faces_in(box: Integers, axis: int) -> tuple[slice, slice, slice]:
    """Index of the faces across `axis` between the nodes of a box."""
    x, y, z = (slice(box[n, 0], box[n, 1] - (n != axis)) for n in range(3))
    return x, y, z


def count_beside_reference(beside: Integers, phi: Array, box: Integers, count: int) -> Integers:
    """`count_beside` in NumPy: the counts after it."""
    out = beside.copy()
    for axis in range(3):
        phi = np.minimum(np.delete(phi, 0, axis), np.delete(phi, -1, axis))
    out[tuple(slice(low, high - 1) for low, high in box)] += count * (phi < 0.0)
    return out


def share_closed_reference(
    own: Array,
    opened: Array,
    total: Array,
    distance: Array,
    beside: Integers,
    box: Integers,
    axis: int,
    sides: Integers,
) -> tuple[Array, Array]:
    """`share_closed` in NumPy: the shares in the box, and the open fractions after it."""
    at, n = faces_in(box, axis), np.arange(box[axis, 0], box[axis, 1])
    union = np.where(own == total[at], own, face_closed_reference(distance, axis)[at])
    ends = [(int(d == axis),) * 2 for d in range(3)]
    most = np.pad(beside, ends, mode="wrap" if sides[0] == PERIODIC else "constant")
    crease = np.maximum(np.delete(most, 0, axis), np.delete(most, -1, axis))[at] > 1
    union = np.where((union > 1.0 - 1e-9) | ((union > 1.0 - CREASE) & crease), 1.0, union)
    touched, out = total[at] > 0.0, opened.copy()
    out[at] = np.where(touched, 1.0 - union, opened[at])
    solid = ((n == 0) & (sides[0] == PRESCRIBED)) | (
        (n == opened.shape[axis] - 1) & (sides[1] == PRESCRIBED)
    )
    counts = touched & ~np.expand_dims(solid, tuple(d for d in range(3) if d != axis))
    part = union * own
    return np.divide(part, total[at], np.zeros_like(own), where=counts), out


def list_closed_reference(
    share: Array, centre: Array, box: Integers, counts: Integers
) -> tuple[Integers, Array, Array]:
    """Flat indices of the faces, their closed parts, and the centres, in NumPy."""
    there = share > 0.0
    places = np.stack(np.nonzero(there)) + box[:, :1]
    return np.ravel_multi_index(tuple(places), tuple(counts)), share[there], centre[:, there].T
