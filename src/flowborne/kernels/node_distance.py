"""Distance to the bodies at the nodes of the grid, in the box around each body."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Integers, Nodes
from flowborne.kernels.edge_crossings import Placed, distance_to
from flowborne.kernels.jit import kernel

BAND = 4.0
"""Distances are known up to this many cells from a body; beyond, they are this large."""

NEAR = 1.75
"""Distance up to which skins are exact, curvature is allowed for, and faces are beside a body,
cells: the diagonal of a cell."""


@kernel
def node_box(
    geoms: Integers, position: Array, rotation: Array, reach: Array, nodes: Nodes, shape: Integers
) -> Integers:
    """Node ranges (low, high per axis) around the given geometries, with the band; may be empty."""
    box, (origin, h, _) = np.empty((3, 2), np.int64), nodes
    for axis in range(3):
        low, high = 1e300, -1e300
        for g in geoms:
            extent = 0.0
            for m in range(3):
                extent += abs(rotation[g, axis, m]) * reach[g, m]
            low = min(low, position[g, axis] - extent)
            high = max(high, position[g, axis] + extent)
        first = np.floor((low - origin[axis]) / h - BAND)
        last = np.ceil((high - origin[axis]) / h + BAND) + 1.0
        box[axis, 0] = int(min(max(first, 0.0), shape[axis] + 1.0))
        box[axis, 1] = int(min(max(last, 0.0), shape[axis] + 1.0))
    return box


@kernel
def lower_to_body(phi: Array, box: Integers, body: Placed, nodes: Nodes) -> None:
    """Lower the distance at the nodes of a box to that of a geometry."""
    origin, h, flat = nodes
    for i in range(phi.shape[0]):
        x = origin[0] + h * (box[0, 0] + i)
        for j in range(phi.shape[1]):
            y = origin[1] + h * (box[1, 0] + j)
            for k in range(phi.shape[2]):
                if flat and k > 0:
                    phi[i, j, k] = phi[i, j, 0]
                    continue
                z = 0.0 if flat else origin[2] + h * (box[2, 0] + k)
                phi[i, j, k] = min(phi[i, j, k], distance_to(body, x, y, z))


@kernel
def merge(distance: Array, nearest: Integers, phi: Array, box: Integers, body: int) -> None:
    """Lower the union's distance to that of one body inside its box."""
    for i in range(box[0, 0], box[0, 1]):
        for j in range(box[1, 0], box[1, 1]):
            for k in range(box[2, 0], box[2, 1]):
                value = phi[i - box[0, 0], j - box[1, 0], k - box[2, 0]]
                if value < distance[i, j, k]:
                    distance[i, j, k] = value
                    nearest[i, j, k] = body
