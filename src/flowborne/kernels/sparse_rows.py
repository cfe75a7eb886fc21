"""Sparse rows J: each belongs to one cell of a field, and has entries in (k,) columns.

Several rows may belong to one cell; see `arrays.Rows`.
"""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Real, Rows
from flowborne.kernels.jit import kernel


@kernel
def sum_rows(p: Real, rows: Rows, size: int) -> Array:
    """(size,) J^T p of a field."""
    cells, row_start, columns, values = rows
    flat = p.reshape(-1)
    load = np.zeros(size)
    for n in range(cells.size):
        value = flat[cells[n]]
        for e in range(row_start[n], row_start[n + 1]):
            load[columns[e]] += values[e] * value
    return load


@kernel
def add_rows(p: Real, rows: Rows, motion: Array) -> None:
    """p += J motion on a field."""
    cells, row_start, columns, values = rows
    flat = p.reshape(-1)
    for n in range(cells.size):
        total = 0.0
        for e in range(row_start[n], row_start[n + 1]):
            total += values[e] * motion[columns[e]]
        flat[cells[n]] += total


@kernel
def row_gram(rows: Rows, inverse: Real, size: int) -> Array:
    """(size, size) J^T D^-1 J for a diagonal D^-1, given as a field."""
    cells, row_start, columns, values = rows
    flat = inverse.reshape(-1)
    gram = np.zeros((size, size))
    for n in range(cells.size):
        share = flat[cells[n]]
        for e in range(row_start[n], row_start[n + 1]):
            for f in range(row_start[n], row_start[n + 1]):
                gram[columns[e], columns[f]] += share * values[e] * values[f]
    return gram


@kernel
def row_gram_along(rows: Rows, inverse: Real, root: Array) -> Array:
    """(m, m) R^T J^T D^-1 J R for modes R (k, m), without the (k, k) matrix between them."""
    cells, row_start, columns, values = rows
    flat = inverse.reshape(-1)
    count = root.shape[1]
    gram, flux = np.zeros((count, count)), np.empty(count)
    for n in range(cells.size):
        flux[:] = 0.0
        for e in range(row_start[n], row_start[n + 1]):
            for a in range(count):
                flux[a] += values[e] * root[columns[e], a]
        for a in range(count):
            for b in range(count):
                gram[a, b] += flux[a] * flux[b] * flat[cells[n]]
    return gram


@kernel
def padded_rows(rows: Rows, diagonal: Array) -> Rows:
    """The rows in active cells, with padded flat indices."""
    cells, row_start, columns, values = rows
    p0, p1, p2 = diagonal.shape
    d = 1 if p0 > 1 else 0
    n1, n2 = p1 - 2, p2 - 2
    flat = diagonal.reshape(-1)
    kept = np.empty_like(cells)
    starts = np.zeros_like(row_start)
    places, entries = np.empty_like(columns), np.empty_like(values)
    count, used = 0, 0
    for n in range(cells.size):
        c = cells[n]
        at = ((c // (n1 * n2) + d) * p1 + (c // n2) % n1 + 1) * p2 + c % n2 + 1
        if flat[at] > 0.0:
            kept[count] = at
            for e in range(row_start[n], row_start[n + 1]):
                places[used], entries[used] = columns[e], values[e]
                used += 1
            count += 1
            starts[count] = used
    return kept[:count], starts[: count + 1], places[:used], entries[:used]
