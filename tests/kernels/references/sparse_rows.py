"""The kernels of `sparse_rows` in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Rows


def padded_rows_reference(rows: Rows, diagonal: Array) -> Rows:
    """`padded_rows` in NumPy."""
    cells, row_start, columns, values = rows
    inside = tuple(slice(1, -1) if n > 1 else slice(None) for n in diagonal.shape)
    padded = np.arange(diagonal.size).reshape(diagonal.shape)[inside].ravel()[cells]
    active, count = diagonal.ravel()[padded] > 0.0, np.diff(row_start)
    entries = np.repeat(active, count)
    starts = np.append(0, np.cumsum(count[active]))
    return padded[active], starts, columns[entries], values[entries]


def dense_rows(rows: Rows, cells: int, size: int) -> Array:
    """(cells, size) J, in which `sum_rows` is J^T p, `add_rows` p += J motion and `row_gram`
    J^T D^-1 J."""
    cell, row_start, columns, values = rows
    J = np.zeros((cells, size))
    np.add.at(J, (np.repeat(cell, np.diff(row_start)), columns), values)
    return J
