"""Distance to the bodies at the nodes of the grid, in the box around each body."""

from __future__ import annotations

import numpy as np
from numba import prange

from flowborne.kernels.arrays import Array, Integers, Nodes
from flowborne.kernels.edge_crossings import Placed, distance_to
from flowborne.kernels.jit import kernel

BAND = 4.0
"""Distances are known up to this many cells from a body; beyond, they are this large."""

FACET = 1.0 / 12.0
"""Mean of what linear interpolation in tetrahedra adds to the distance to a curved surface, over
h^2 and the sum of its curvatures."""

NEAR = 1.75
"""Distance up to which curvature is allowed for, cells: the diagonal of a cell."""


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
def gentlest(a: float, b: float, c: float) -> float:
    """The smallest of three numbers of one sign; 0 where their signs differ."""
    if a > 0.0 and b > 0.0 and c > 0.0:
        return min(a, min(b, c))
    if a < 0.0 and b < 0.0 and c < 0.0:
        return max(a, max(b, c))
    return 0.0


@kernel
def bend(phi: Array, i: int | np.int64, j: int, k: int, axis: int) -> float:
    """Second difference along an axis, the gentlest of that here and those beside: 0 at a kink."""
    di, dj, dk = int(axis == 0), int(axis == 1), int(axis == 2)
    at = i if axis == 0 else (j if axis == 1 else k)
    if at < 2 or at > phi.shape[axis] - 3:
        return 0.0
    a, b = phi[i - 2 * di, j - 2 * dj, k - 2 * dk], phi[i - di, j - dj, k - dk]
    c, d = phi[i, j, k], phi[i + di, j + dj, k + dk]
    e = phi[i + 2 * di, j + 2 * dj, k + 2 * dk]
    return gentlest(a - 2.0 * b + c, b - 2.0 * c + d, c - 2.0 * d + e)


@kernel
def allow_for_curvature(phi: Array, h: float) -> Array:
    """The distance with which facets leave a curved body of a room its size.

    A ball of 8 cells across would lack 3.1 % of its volume. Where the distance has a kink, at edges
    and in the middle of thin plates, it is left as it is; so it is in a slab, where a disc lacks
    1.3 %, because there the chords that bodies push with are right as they are.
    """
    out = phi.copy()
    if phi.shape[2] == 2:
        return out
    for plane in prange(phi.shape[0]):
        i = np.int64(plane)
        for j in range(phi.shape[1]):
            for k in range(phi.shape[2]):
                if abs(phi[i, j, k]) < NEAR * h:
                    total = bend(phi, i, j, k, 0) + bend(phi, i, j, k, 1) + bend(phi, i, j, k, 2)
                    out[i, j, k] -= FACET * total
    return out


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
