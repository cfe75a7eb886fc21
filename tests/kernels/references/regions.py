"""The kernels of `regions` in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Finest, Labels, Periodic, Rows
from flowborne.kernels.regions import NULL

from ..padded import cells_of
from .sparse_rows import dense_rows


def label_regions_reference(finest: Finest, periodic: Periodic) -> Labels:
    """`label_regions` in NumPy: the labels, in the order of their first cells."""
    from scipy.sparse import coo_array  # for this statement alone
    from scipy.sparse.csgraph import connected_components

    *w, diagonal = finest
    inside = cells_of(diagonal)
    shape = diagonal[inside].shape
    number = np.arange(diagonal[inside].size).reshape(shape)
    outside = number.size
    pairs = []
    for axis in range(3):
        if diagonal.shape[axis] > 1:
            ends = list(inside)
            ends[axis] = slice(1, None)
            faces = np.moveaxis(w[axis][tuple(ends)], axis, 0) > 0.0
            cells = np.moveaxis(number, axis, 0)
            beyond = np.full_like(cells[:1], outside)
            low = np.concatenate([cells[-1:] if periodic[axis] else beyond, cells])
            high = np.concatenate([cells, cells[:1] if periodic[axis] else beyond])
            pairs.append(np.stack([low[faces], high[faces]]))
    a, b = np.concatenate(pairs, axis=1)
    graph = coo_array((np.ones(a.size), (a, b)), shape=(outside + 1, outside + 1))
    part = connected_components(graph, directed=False)[1]
    closed = (part[:-1] != part[-1]) & (diagonal[inside].ravel() > 0.0)
    _, first, which = np.unique(part[:-1][closed], return_index=True, return_inverse=True)
    label = np.full(diagonal.shape, -1, np.int32)
    found = np.full(outside, -1, np.int32)
    found[closed] = np.argsort(np.argsort(first))[which]
    label[inside] = found.reshape(shape)
    return label


def remove_null_reference(x: Array, label: Labels, basis: Array) -> Array:
    """`remove_null` in NumPy: x after it."""
    inside = label >= 0
    N = basis[label[inside]]
    out = x.copy()
    out[inside] -= N @ (N.T @ x[inside])
    return out


def region_loads_reference(label: Labels, regions: int, size: int, rows: Rows) -> Array:
    """`region_loads` in NumPy."""
    J = dense_rows(rows, label.size, size)
    ones = (label.ravel() == np.arange(regions)[:, None]).astype(np.float64)
    loads = ones @ J
    amounts = ones @ dense_rows((*rows[:3], np.abs(rows[3])), label.size, size)
    return np.where(np.abs(loads) < NULL * amounts, 0.0, loads)
