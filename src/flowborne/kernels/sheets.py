"""Distance to sheets of one thickness about triangles: what the thin parts of a mesh become."""

from __future__ import annotations

import numpy as np
from numba import njit

from flowborne.kernels.arrays import Array, Integers, Point
from flowborne.kernels.triangles import closest_on_triangle, squared_distance


@njit(nogil=True, cache=True)
def beyond(p: Point, q: Array, m: Array) -> float:
    """How far p is from q along m, m."""
    return m[0] * (p[0] - q[0]) + m[1] * (p[1] - q[1]) + m[2] * (p[2] - q[2])


@njit(nogil=True, cache=True)
def squared(p: Point, q: Point) -> float:
    """Square of the distance of two points, m^2."""
    return (p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 + (p[2] - q[2]) ** 2


@njit(nogil=True, cache=True)
def lower_to_sheets(
    values: Array,
    corner: Array,
    pitch: float,
    triangles: Array,
    normal: Array,
    outward: Array,
    limit: Array,
    number: Integers,
    start: Integers,
    rims: Integers,
    half: float,
    band: float,
) -> None:
    """Lower values on a lattice to the distances to sheets, m, negative inside.

    A sheet is as far as `half` m from its triangle, and beyond an edge no farther than the limit.

    values     (nx, ny, nz) m;  corner  (3,) place of the first, m;  pitch  between two, m
    triangles  (m, 3, 3) m
    normal     (m, 3) unit vectors
    outward    (m, 3, 3) unit vectors across the edges, away from the triangle, in its plane
    limit      (m, 3) m; infinite where an edge is none of the sheet's
    number     (m, 3) of the triangles' corners among all vertices
    start      (vertices + 1,) where the edges of sheets begin in the list that end at a vertex
    rims       those edges: 3 triangle + edge
    band       distances up to which values are lowered, m
    """
    first, last = np.empty(3, np.int64), np.empty(3, np.int64)
    for t in range(len(triangles)):
        for d in range(3):
            low, high = triangles[t, :, d].min(), triangles[t, :, d].max()
            first[d] = max(int(np.ceil((low - half - band - corner[d]) / pitch)), 0)
            last[d] = min(
                int(np.floor((high + half + band - corner[d]) / pitch)) + 1, values.shape[d]
            )
        a = (triangles[t, 0, 0], triangles[t, 0, 1], triangles[t, 0, 2])
        b = (triangles[t, 1, 0], triangles[t, 1, 1], triangles[t, 1, 2])
        c = (triangles[t, 2, 0], triangles[t, 2, 1], triangles[t, 2, 2])
        n = normal[t]
        centre = (
            (a[0] + b[0] + c[0]) / 3.0, (a[1] + b[1] + c[1]) / 3.0, (a[2] + b[2] + c[2]) / 3.0,
        )  # fmt: skip
        radius = np.sqrt(max(squared(centre, a), squared(centre, b), squared(centre, c)))
        for i in range(first[0], last[0]):
            x = corner[0] + pitch * i
            for j in range(first[1], last[1]):
                y = corner[1] + pitch * j
                for k in range(first[2], last[2]):
                    z = corner[2] + pitch * k
                    above = n[0] * (x - a[0]) + n[1] * (y - a[1]) + n[2] * (z - a[2])
                    if abs(above) - half >= values[i, j, k]:
                        continue
                    p = (x, y, z)
                    nearer = values[i, j, k] + half + radius
                    if squared(p, centre) >= nearer * nearer:
                        continue
                    weight = closest_on_triangle(p, a, b, c)
                    value = np.sqrt(squared_distance(p, a, b, c, weight)) - half
                    for e in range(3):
                        q = triangles[t, e]
                        value = max(value, beyond(p, q, outward[t, e]) - limit[t, e])
                        if weight[e] == 1.0:
                            for at in range(start[number[t, e]], start[number[t, e] + 1]):
                                rim, side = rims[at] // 3, rims[at] % 3
                                value = max(
                                    value, beyond(p, q, outward[rim, side]) - limit[rim, side]
                                )
                    values[i, j, k] = min(values[i, j, k], value)
