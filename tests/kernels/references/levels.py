"""The kernels of `levels` in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.aggregates import OWN
from flowborne.kernels.arrays import (
    Array,
    Faces,
    Finest,
    Indices,
    Integers,
    Marks,
    Periodic,
    Real,
    Triple,
)

from ..padded import cells_of
from .laplacian import neighbour_sum


def finest_weights_reference(faces: Faces) -> Finest:
    """`finest_weights` in NumPy: padded weights and diagonal."""
    shape = faces[1].shape[0], faces[1].shape[1] - 1, faces[1].shape[2]
    if shape[0] == 1:
        faces = np.zeros((2, *shape[1:])), faces[1], faces[2]
    sides = [(int(n > 1),) * 2 for n in shape]
    diagonal = np.zeros(shape)
    w = []
    for axis, values in enumerate(faces):
        diagonal += np.delete(values, -1, axis) + np.delete(values, 0, axis)
        ends = sides.copy()
        ends[axis] = (sides[axis][0], 0)
        padded = np.pad(values, ends)
        w.append(padded if shape[axis] > 1 else np.delete(padded, -1, axis))
    return w[0], w[1], w[2], np.pad(diagonal, sides)


def coarse_weights_reference(
    fine: Real, marks: Marks, axis: int, factor: Integers, ratio: Array
) -> Array:
    """`coarse_weights` in NumPy: weights of the faces across `axis`, without ghosts."""
    own = (marks & np.roll(marks, 1, axis)) >= OWN
    values = np.where(own, fine, 0.0)
    for n in range(3):
        ends = int(fine.shape[n] > 1)
        inner = np.moveaxis(values, n, 0)[
            ends : len(np.moveaxis(values, n, 0)) + (n == axis) - ends
        ]
        if n == axis:
            chosen = np.minimum(
                factor[n] * np.arange(-(-(len(inner) - 1) // factor[n]) + 1), len(inner) - 1
            )
            values = np.moveaxis(inner[chosen], 0, n)
        else:
            values = np.moveaxis(np.add.reduceat(inner, np.arange(0, len(inner), factor[n])), 0, n)
    across = [1, 1, 1]
    across[axis] = -1
    return values * ratio[: values.shape[axis]].reshape(across)


def inverse_diagonal_reference(w: Triple, added: Real) -> Array:
    """`inverse_diagonal` in NumPy."""
    inside, out = cells_of(w[0]), np.zeros(w[0].shape)
    total = neighbour_sum(np.ones_like(out), w)[inside]
    out[inside] = np.divide(1.0, total + added[inside], np.zeros_like(total), where=total > 0.0)
    return out


def coarse_sums_reference(
    fine: Real,
    marks: Marks,
    factor: Integers,
    orphans: Indices,
    aggregates: Indices,
    shape: Integers,
) -> Array:
    """`coarse_sums` in NumPy: a padded array of `shape`."""
    out, inside = np.zeros(shape), cells_of(fine)
    values = np.where(marks & OWN, fine, 0.0)[inside]
    for n in range(3):
        values = np.add.reduceat(values, np.arange(0, values.shape[n], factor[n]), axis=n)
    out[cells_of(out)] = values
    np.add.at(out.reshape(-1), aggregates.reshape(-1)[orphans], fine.reshape(-1)[orphans])
    return out


def columns_to_diagonal_reference(weights: Triple, added: Real, periodic: Periodic) -> None:
    """`columns_to_diagonal` in NumPy."""
    for axis, across in enumerate(weights):
        faces, cells = across.swapaxes(0, axis), added.swapaxes(0, axis)
        n = added.shape[axis] - 2
        if periodic[axis] or n < 1:
            continue
        for cell, outer, inner in ((1, 1, 2), (n, n + 1, n)):
            moved = np.where(faces[outer] < faces[inner], faces[outer], 0.0)
            cells[cell] += moved
            faces[outer] -= moved
