"""Triangles: the point of one that is closest to a place, the distance to a closed mesh of them,
where parallel lines cross them, and the distance to sheets about them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flowborne.kernels.arrays import Array, Integers, Point
from flowborne.kernels.jit import kernel


@kernel
def closest_on_triangle(p: Point, a: Point, b: Point, c: Point) -> Point:
    """Weights of a, b, c at the point of their triangle closest to p (Ericson 2005, 5.1.5)."""
    abx, aby, abz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    acx, acy, acz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    x, y, z = p[0] - a[0], p[1] - a[1], p[2] - a[2]
    d1, d2 = abx * x + aby * y + abz * z, acx * x + acy * y + acz * z
    if d1 <= 0.0 and d2 <= 0.0:
        return 1.0, 0.0, 0.0
    x, y, z = p[0] - b[0], p[1] - b[1], p[2] - b[2]
    d3, d4 = abx * x + aby * y + abz * z, acx * x + acy * y + acz * z
    if d3 >= 0.0 and d4 <= d3:
        return 0.0, 1.0, 0.0
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 >= d3 and d1 > d3:
        t = d1 / (d1 - d3)
        return 1.0 - t, t, 0.0
    x, y, z = p[0] - c[0], p[1] - c[1], p[2] - c[2]
    d5, d6 = abx * x + aby * y + abz * z, acx * x + acy * y + acz * z
    if d6 >= 0.0 and d5 <= d6:
        return 0.0, 0.0, 1.0
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 >= d6 and d2 > d6:
        t = d2 / (d2 - d6)
        return 1.0 - t, 0.0, t
    va = d3 * d6 - d5 * d4
    along, back = d4 - d3, d5 - d6
    if va <= 0.0 and along >= 0.0 and back >= 0.0 and along + back > 0.0:
        t = along / (along + back)
        return 0.0, 1.0 - t, t
    total = va + vb + vc
    return va / total, vb / total, vc / total


@kernel
def crossed(a: Point | Array, b: Point | Array) -> Point:
    """a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@kernel
def along(a: Point | Array, b: Point | Array) -> float:
    """a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def squared_distance(p: Point, a: Point, b: Point, c: Point, weights: Point) -> float:
    """Square of the distance from p to the point of the triangle with the given weights."""
    total = 0.0
    for m in range(3):
        away = weights[0] * (a[m] - p[m]) + weights[1] * (b[m] - p[m]) + weights[2] * (c[m] - p[m])
        total += away * away
    return total


@kernel
def distances_to_mesh(points: Array, vertices: Array, faces: Integers) -> Array:
    """(n,) signed distances of points (n, 3) to a closed mesh, negative inside, m.

    The sign is that of the winding number (van Oosterom and Strackee 1983).
    """
    distance = np.empty(len(points))
    for n in range(len(points)):
        p = points[n]
        nearest, angle = 1e30, 0.0
        for t in range(faces.shape[0]):
            a, b, c = vertices[faces[t, 0]], vertices[faces[t, 1]], vertices[faces[t, 2]]
            closest = closest_on_triangle(p, a, b, c)
            nearest = min(nearest, squared_distance(p, a, b, c, closest))
            u, v, w = a - p, b - p, c - p
            lu, lv, lw = np.sqrt(u.dot(u)), np.sqrt(v.dot(v)), np.sqrt(w.dot(w))
            below = lu * lv * lw + u.dot(v) * lw + v.dot(w) * lu + w.dot(u) * lv
            angle += 2.0 * np.arctan2(along(u, crossed(v, w)), below)
        away = np.sqrt(nearest)
        distance[n] = -away if angle > 2.0 * np.pi else away
    return distance


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


@kernel
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
    for t in range(len(triangles)):
        a = vertices[triangles[t, 0]]
        e, f = vertices[triangles[t, 1]] - a, vertices[triangles[t, 2]] - a
        p = crossed(direction, f)
        determinant = along(e, p)
        if abs(determinant) < 1e-300:
            continue
        for at in range(first[t], last[t]):
            line = order[at]
            gap = origins[line, 0] - a[0], origins[line, 1] - a[1], origins[line, 2] - a[2]
            u = along(gap, p) / determinant
            if u < 0.0 or u > 1.0:
                continue
            q = crossed(gap, e)
            v = along(q, direction) / determinant
            if v < 0.0 or u + v >= 1.0:
                continue
            lines.append(line)
            places.append(along(q, f) / determinant)
            signs.append(np.sign(determinant))
    return np.array(lines[1:]), np.array(places[1:]), np.array(signs[1:])


@kernel
def beyond(p: Point, q: Array, m: Array) -> float:
    """How far p is from q along m, m."""
    return m[0] * (p[0] - q[0]) + m[1] * (p[1] - q[1]) + m[2] * (p[2] - q[2])


@kernel
def squared(p: Point, q: Point) -> float:
    """Square of the distance of two points, m^2."""
    return (p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 + (p[2] - q[2]) ** 2


class Sheets(NamedTuple):
    """Sheets that reach `half` m from a triangle each, and beyond an edge no farther than a limit.

    triangles  (m, 3, 3) m
    normal     (m, 3) unit vectors
    outward    (m, 3, 3) unit vectors across the edges, away from the triangle, in its plane
    limit      (m, 3) m; infinite where an edge is none of the sheet's
    number     (m, 3) of the triangles' corners among all vertices
    start      (vertices + 1,) where the edges of sheets begin in the list that end at a vertex
    rims       those edges: 3 triangle + edge
    half       m
    """

    triangles: Array
    normal: Array
    outward: Array
    limit: Array
    number: Integers
    start: Integers
    rims: Integers
    half: float


@kernel
def lower_to_sheets(
    values: Array, corner: Array, pitch: float, sheets: Sheets, band: float
) -> None:
    """Lower values on a lattice to the distances to sheets, m, negative inside.

    values  (nx, ny, nz) m;  corner  (3,) place of the first, m;  pitch  between two, m
    band    distances up to which values are lowered, m
    """
    triangles, normal, outward, limit, number, start, rims, half = sheets
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
