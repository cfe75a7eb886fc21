"""How far it is through a body of triangles."""

from __future__ import annotations

import numpy as np
from numba import njit

from flowborne.kernels.arrays import Array, Integers, Point
from flowborne.kernels.skin import ON_SKIN

MOST_CELLS = 128.0
"""Cells along the longest side of a body in which its triangles are looked up, at most."""

MOST_LISTED = 64
"""Cells in which a triangle is listed on average, at most; slivers get larger cells."""


@njit(nogil=True, cache=True)
def crossed(a: Point, b: Point) -> Point:
    """a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit(nogil=True, cache=True)
def along(a: Point, b: Point) -> float:
    """a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(nogil=True, cache=True)
def apart(vertices: Array, a: int, b: int) -> Point:
    """From vertex a to vertex b."""
    p, q = vertices[a], vertices[b]
    return q[0] - p[0], q[1] - p[1], q[2] - p[2]


def way_inward(vertices: Array, triangles: Integers) -> Array:
    """(k,) distance from the middle of each triangle straight inward to another one, m.

    Infinite where there is no other side. The triangles are looked up in cells, about as many
    along the longest side as a sphere of so many triangles has of them.

    vertices, triangles  (n, 3) m; (k, 3) outward
    """
    low, extent = vertices.min(axis=0), np.ptp(vertices, axis=0)
    cells = min(MOST_CELLS, np.sqrt(len(triangles)))
    while True:
        edge = float(extent.max() / cells)
        counts = (extent / edge).astype(np.int64) + 1
        corners = (vertices[triangles] - low) / edge
        first = np.maximum(np.floor(corners.min(axis=1) - ON_SKIN), 0.0).astype(np.int64)
        last = np.minimum(np.floor(corners.max(axis=1) + ON_SKIN), counts - 1).astype(np.int64)
        number = (last - first + 1).prod(axis=1)
        if cells < 2.0 or number.sum() <= MOST_LISTED * len(triangles):
            break
        cells /= 2.0
    triangle = np.repeat(np.arange(len(triangles)), number)
    place = np.arange(len(triangle)) - np.repeat(np.cumsum(number) - number, number)
    _, wide, deep = np.moveaxis((last - first + 1)[triangle], 1, 0)
    across = np.stack([place // (wide * deep), place // deep % wide, place % deep], axis=1)
    cell = np.ravel_multi_index(tuple((first[triangle] + across).T), tuple(counts))
    order = np.argsort(cell, kind="stable")
    start = np.searchsorted(cell[order], np.arange(counts.prod() + 1))
    return _way_inward(vertices, triangles, low, edge, counts, start, triangle[order])


@njit(nogil=True, cache=True)
def _way_inward(
    vertices: Array,
    triangles: Integers,
    low: Array,
    edge: float,
    counts: Integers,
    start: Integers,
    listed: Integers,
) -> Array:
    """From cell to cell along each ray (Amanatides and Woo 1987).

    It meets a triangle where the volumes that it spans with its edges have one sign (Möller and
    Trumbore 1997).
    """
    way = np.full(len(triangles), np.inf)
    cell, step = np.empty(3, np.int64), np.empty(3, np.int64)
    leaves, through = np.empty(3), np.empty(3)
    for n in range(len(triangles)):
        a, b, c = triangles[n]
        inward = crossed(apart(vertices, a, c), apart(vertices, a, b))
        length = np.sqrt(along(inward, inward))
        if length == 0.0:
            continue
        middle = (
            (vertices[a, 0] + vertices[b, 0] + vertices[c, 0]) / 3.0,
            (vertices[a, 1] + vertices[b, 1] + vertices[c, 1]) / 3.0,
            (vertices[a, 2] + vertices[b, 2] + vertices[c, 2]) / 3.0,
        )
        for d in range(3):
            cell[d] = min(int((middle[d] - low[d]) / edge), counts[d] - 1)
            step[d] = 1 if inward[d] > 0.0 else -1
            leaves[d] = through[d] = np.inf
            if inward[d] != 0.0:
                face = low[d] + edge * (cell[d] + (inward[d] > 0.0))
                leaves[d] = (face - middle[d]) / inward[d] * length
                through[d] = edge / abs(inward[d]) * length
        while True:
            flat = (cell[0] * counts[1] + cell[1]) * counts[2] + cell[2]
            for at in range(start[flat], start[flat + 1]):
                m = listed[at]
                p, q, r = triangles[m]
                e, f = apart(vertices, p, q), apart(vertices, p, r)
                side = crossed(inward, f)
                volume = along(e, side)
                if m == n or volume == 0.0:
                    continue
                first = vertices[p]
                gap = middle[0] - first[0], middle[1] - first[1], middle[2] - first[2]
                u = along(gap, side) / volume
                if u < 0.0 or u > 1.0:
                    continue
                up = crossed(gap, e)
                v = along(inward, up) / volume
                if v < 0.0 or u + v > 1.0:
                    continue
                t = length * along(f, up) / volume
                if 0.0 < t < way[n]:
                    way[n] = t
            d = int(np.argmin(leaves))
            if way[n] <= leaves[d]:
                break
            cell[d] += step[d]
            leaves[d] += through[d]
            if cell[d] < 0 or cell[d] >= counts[d]:
                break
    return way


def way_inward_reference(vertices: Array, triangles: Integers) -> Array:
    """`way_inward` in NumPy, triangle by triangle through the plane of every other one."""
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    middle, inward = (a + b + c) / 3.0, np.cross(c - a, b - a)
    inward /= np.linalg.norm(inward, axis=1)[:, None]
    normal, way = np.cross(b - a, c - a), np.full(len(a), np.inf)
    for n in range(len(a)):
        with np.errstate(divide="ignore", invalid="ignore"):
            t = np.einsum("td,td->t", a - middle[n], normal) / (normal @ inward[n])
            hit = middle[n] + t[:, None] * inward[n]
        sides = [np.cross(q - p, hit - p) for p, q in ((a, b), (b, c), (c, a))]
        within = np.all([np.einsum("td,td->t", side, normal) >= 0.0 for side in sides], axis=0)
        within &= (t > 0.0) & (np.arange(len(a)) != n)
        way[n] = t[within].min(initial=np.inf)
    return way
