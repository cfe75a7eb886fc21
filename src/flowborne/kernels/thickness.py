"""How far it is through a body of triangles."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flowborne.kernels.arrays import Array, Integers, Mask, Point
from flowborne.kernels.jit import kernel
from flowborne.kernels.skin import ON_SKIN
from flowborne.kernels.triangles import along, closest_on_triangle, crossed, squared_distance

MOST_CELLS = 128.0
"""Cells along the longest side of a body in which its triangles are looked up, at most."""

MOST_LISTED = 64
"""Cells in which a triangle is listed on average, at most; slivers get larger cells."""


@kernel
def apart(vertices: Array, a: int, b: int) -> Point:
    """From vertex a to vertex b."""
    p, q = vertices[a], vertices[b]
    return q[0] - p[0], q[1] - p[1], q[2] - p[2]


class Cells(NamedTuple):
    """Triangles listed by the cells of a lattice that they reach.

    low     (3,) corner of the lattice, m
    edge    of a cell, m
    counts  (3,) cells along each axis
    start   (cells + 1,) where a cell's triangles begin in the list
    listed  numbers of triangles
    """

    low: Array
    edge: float
    counts: Integers
    start: Integers
    listed: Integers


def way_inward(vertices: Array, triangles: Integers) -> Array:
    """(k,) distance from the middle of each triangle straight inward to another one, m.

    Infinite where there is no other side.

    vertices, triangles  (n, 3) m; (k, 3) outward
    """
    return _way_inward(vertices, triangles, by_cells(vertices, triangles))


def by_cells(vertices: Array, triangles: Integers) -> Cells:
    """Triangles in cells, about as many along the longest side as a sphere of so many triangles has
    of them.

    vertices, triangles  (n, 3) m; (k, 3)
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
    return Cells(low, edge, counts, start, triangle[order])


def any_within(
    places: Array, radius: float, vertices: Array, triangles: Integers, cells: Cells
) -> Mask:
    """(m,) whether a triangle is within `radius` m of each of places (m, 3).

    The nearest cells first: where there is one, most of the others are not looked into.
    """
    found = np.zeros(len(places), np.bool_)
    for part in (0.25, 0.5, 1.0):
        left = ~found
        found[left] = _any_within(places[left], part * radius, vertices, triangles, cells)
    return found


@kernel
def _any_within(
    places: Array, radius: float, vertices: Array, triangles: Integers, cells: Cells
) -> Mask:
    low, edge, counts, start, listed = cells
    found = np.zeros(len(places), np.bool_)
    first, last = np.empty(3, np.int64), np.empty(3, np.int64)
    looked_at = np.full(len(triangles), -1)
    for n in range(len(places)):
        p = (places[n, 0], places[n, 1], places[n, 2])
        for d in range(3):
            first[d] = max(int(np.floor((p[d] - radius - low[d]) / edge)), 0)
            last[d] = min(int(np.floor((p[d] + radius - low[d]) / edge)), counts[d] - 1)
        for row in range(max(last[0] - first[0] + 1, 0) * max(last[1] - first[1] + 1, 0)):
            i = first[0] + row // (last[1] - first[1] + 1)
            j = first[1] + row % (last[1] - first[1] + 1)
            if found[n] or last[2] < first[2]:
                break
            along_z = (i * counts[1] + j) * counts[2]
            for at in range(start[along_z + first[2]], start[along_z + last[2] + 1]):
                t = listed[at]
                if looked_at[t] == n:
                    continue
                looked_at[t] = n
                u, v, w = triangles[t]
                a = (vertices[u, 0], vertices[u, 1], vertices[u, 2])
                b = (vertices[v, 0], vertices[v, 1], vertices[v, 2])
                c = (vertices[w, 0], vertices[w, 1], vertices[w, 2])
                closest = closest_on_triangle(p, a, b, c)
                if squared_distance(p, a, b, c, closest) <= radius * radius:
                    found[n] = True
                    break
    return found


@kernel
def _way_inward(vertices: Array, triangles: Integers, cells: Cells) -> Array:
    """From cell to cell along each ray (Amanatides and Woo 1987).

    It meets a triangle where the volumes that it spans with its edges have one sign (Möller and
    Trumbore 1997).
    """
    low, edge, counts, start, listed = cells
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
