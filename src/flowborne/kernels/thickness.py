"""How far it is through a body of triangles."""

from __future__ import annotations

import numpy as np
from numba import njit

from flowborne.kernels.arrays import Array, Integers, Point
from flowborne.kernels.skin import BESIDE, triangles_by_cell

MOST_CELLS = 128.0
"""Cells along the longest side of a body in which its triangles are looked up, at most."""


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


@njit(nogil=True, cache=True)
def way_inward(vertices: Array, triangles: Integers, limit: float) -> Array:
    """(k,) distance from the middle of each triangle straight inward to another one, m.

    The ray meets a triangle where the volumes that it spans with its edges have one sign (Möller
    and Trumbore 1997). Infinite where there is no other side, or it is farther than `limit` m.
    """
    middles = np.empty((len(triangles), 3))
    longest = 0.0
    for d in range(3):
        for n in range(len(triangles)):
            a, b, c = triangles[n]
            middles[n, d] = (vertices[a, d] + vertices[b, d] + vertices[c, d]) / 3.0
        longest = max(longest, np.ptp(vertices[:, d]))
    edge = max(min(limit, longest) / BESIDE, longest / MOST_CELLS)
    number, start, listed = triangles_by_cell(middles, vertices, triangles, edge)
    way = np.full(len(triangles), np.inf)
    for n in range(len(triangles)):
        a, b, c = triangles[n]
        inward = crossed(apart(vertices, a, c), apart(vertices, a, b))
        length = np.sqrt(along(inward, inward))
        middle = middles[n, 0], middles[n, 1], middles[n, 2]
        for at in range(start[number[n]], start[number[n] + 1]):
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
            if 0.0 < t < way[n] and t <= limit:
                way[n] = t
    return way


def way_inward_reference(vertices: Array, triangles: Integers, limit: float) -> Array:
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
        within &= (t > 0.0) & (t <= limit) & (np.arange(len(a)) != n)
        way[n] = t[within].min(initial=np.inf)
    return way
