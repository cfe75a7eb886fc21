"""Where parallel lines cross the triangles of a surface."""

from __future__ import annotations

import numpy as np
from numba import njit

from flowborne.kernels.arrays import Array, Integers


def crossings(
    vertices: Array, triangles: Integers, origins: Array, direction: Array
) -> tuple[Integers, Array, Array]:
    """Triangle by triangle (Möller and Trumbore 1997), each with the lines beside it alone.

    origins    (n, 3) of the lines, m
    direction  (3,) of all
    returns    (k,) numbers of the lines, (k,) places in directions from the origin, (k,) signs: 1
               where a line enters
    """
    across = np.linalg.svd(direction[None])[2][1]
    beside = origins @ across
    order = np.argsort(beside, kind="stable")
    corners = (vertices @ across)[triangles]
    rounding = 1e-12 * (np.abs(beside).max(initial=0.0) + np.abs(corners).max(initial=0.0))
    first = np.searchsorted(beside[order], corners.min(axis=1) - rounding)
    last = np.searchsorted(beside[order], corners.max(axis=1) + rounding, side="right")
    return _crossings(vertices, triangles, origins, direction, order, first, last)


@njit(nogil=True, cache=True)
def _crossings(
    vertices: Array,
    triangles: Integers,
    origins: Array,
    direction: Array,
    order: Integers,
    first: Integers,
    last: Integers,
) -> tuple[Integers, Array, Array]:
    lines, places, signs = [np.int64(0)], [0.0], [0.0]
    p, q = np.empty(3), np.empty(3)
    for t in range(len(triangles)):
        a = vertices[triangles[t, 0]]
        e, f = vertices[triangles[t, 1]] - a, vertices[triangles[t, 2]] - a
        p[0] = direction[1] * f[2] - direction[2] * f[1]
        p[1] = direction[2] * f[0] - direction[0] * f[2]
        p[2] = direction[0] * f[1] - direction[1] * f[0]
        determinant = e[0] * p[0] + e[1] * p[1] + e[2] * p[2]
        if abs(determinant) < 1e-300:
            continue
        for at in range(first[t], last[t]):
            line = order[at]
            x, y, z = origins[line, 0] - a[0], origins[line, 1] - a[1], origins[line, 2] - a[2]
            u = (x * p[0] + y * p[1] + z * p[2]) / determinant
            if u < 0.0 or u > 1.0:
                continue
            q[0] = y * e[2] - z * e[1]
            q[1] = z * e[0] - x * e[2]
            q[2] = x * e[1] - y * e[0]
            v = (q[0] * direction[0] + q[1] * direction[1] + q[2] * direction[2]) / determinant
            if v < 0.0 or u + v >= 1.0:
                continue
            lines.append(line)
            places.append((q[0] * f[0] + q[1] * f[1] + q[2] * f[2]) / determinant)
            signs.append(np.sign(determinant))
    return np.array(lines[1:]), np.array(places[1:]), np.array(signs[1:])
