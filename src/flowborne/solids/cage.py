"""Flesh that a grid of cells carries: the weights by which its nodes carry each vertex.

MuJoCo's "trilinear" and "quadratic" flexes: 8 or 27 nodes a cell, Lagrange's polynomials between.
"""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

Array = NDArray[np.float64]


def node_weights(mj: mujoco.MjModel, flex: int) -> csr_array:
    """(vertices, nodes) weights; a vertex is where its weights times the nodes' places are."""
    first, count = mj.flex_nodeadr[flex], mj.flex_nodenum[flex]
    nodes = mj.flex_node0[first : first + count]
    start = mj.flex_vertadr[flex]
    unit = mj.flex_vert0[start : start + mj.flex_vertnum[flex]]
    cells = mj.flex_cellnum[flex].astype(np.int64)
    order = abs(int(mj.flex_interp[flex]))
    low, size = nodes.min(axis=0), np.ptp(nodes, axis=0)
    across = order * cells
    place = np.rint((nodes - low) / size * across).astype(np.int64)
    number = np.full(across + 1, -1)
    number[tuple(place.T)] = np.arange(count)
    cell = np.clip((unit * cells).astype(np.int64), 0, cells - 1)
    along = [_lagrange(unit[:, a] * cells[a] - cell[:, a], order) for a in range(3)]
    columns, values = [], []
    for i, j, k in np.ndindex(*(3 * (order + 1,))):
        columns.append(number[tuple((order * cell + (i, j, k)).T)])
        values.append(along[0][i] * along[1][j] * along[2][k])
    column, value = np.stack(columns, axis=1), np.stack(values, axis=1)
    rows = np.repeat(np.arange(len(unit)), column.shape[1])
    kept = np.abs(value.ravel()) > 0.0
    entries = (value.ravel()[kept], (rows[kept], column.ravel()[kept]))
    return csr_array(entries, shape=(len(unit), count))


def _lagrange(t: Array, order: int) -> list[Array]:
    """Lagrange's polynomials of order 1 or 2 on equally spaced nodes of [0, 1], at t."""
    if order == 1:
        return [1.0 - t, t]
    return [(1.0 - t) * (1.0 - 2.0 * t), 4.0 * t * (1.0 - t), t * (2.0 * t - 1.0)]
