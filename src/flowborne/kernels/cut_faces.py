"""The part of each face that bodies close: a polygon through the crossings on its four edges.

Between two crossings the wall goes as their normals have it. On two smooth pieces of the surface,
which meet in an edge or corner, it follows one tangent to where it meets the other; on one piece
it is the arc of a circle, which here is a polygon of the same area.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from flowborne.kernels.arrays import Array
from flowborne.kernels.edge_crossings import Crossings
from flowborne.kernels.jit import inlined

FLAT = 1e-2
"""Turn of the normal along an arc, radians, below which its area is that of a parabola's; smaller
ones leave rounding errors."""

Place = tuple[float, float]


@njit(nogil=True, cache=True)
def other_axes(axis: int) -> tuple[int, int]:
    """The two others in their order."""
    return int(axis == 0), 2 - int(axis == 2)


@inlined
def open_edge(phi: Array, found: Crossings, d: int, i: int, j: int, k: int) -> float:
    """Open part of the edge from node (i, j, k) along d.

    phi  signed distance at the nodes; where no crossing is known, it is linear along the edge
    """
    a, b = phi[i, j, k], phi[i + int(d == 0), j + int(d == 1), k + int(d == 2)]
    if (a < 0.0) == (b < 0.0):
        return 0.0 if a < 0.0 else 1.0
    n = found.at[d, i, j, k]
    if n < 0:
        return max(a, b) / (max(a, b) - min(a, b))
    return float(found.part[n])


@inlined
def nodes_inside(phi: Array, axis: int, i: int, j: int, k: int) -> int:
    """How many of the four nodes of face (i, j, k) across `axis` are inside."""
    s, t = other_axes(axis)
    si, sj, ti, tj, tk = int(s == 0), int(s == 1), int(t == 0), int(t == 1), int(t == 2)
    return (
        int(phi[i, j, k] < 0.0)
        + int(phi[i + si, j + sj, k] < 0.0)
        + int(phi[i + si + ti, j + sj + tj, k + tk] < 0.0)
        + int(phi[i + ti, j + tj, k + tk] < 0.0)
    )


@njit(nogil=True, cache=True)
def corner_of(n: int) -> tuple[int, int]:
    """Corners 0 to 3 of a unit square in turn."""
    return int(n == 1 or n == 2), int(n >= 2)


@njit(nogil=True, cache=True)
def wall_between(p: Place, q: Place, m: Place, n: Place, smooth: bool) -> tuple[float, float, bool]:
    """The point in the unit square by way of which a wall goes from p to q; whether it is a corner.

    m, n    normals at p and q
    smooth  whether both are on one smooth piece
    """
    x, y = 0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])
    size = np.sqrt((m[0] ** 2 + m[1] ** 2) * (n[0] ** 2 + n[1] ** 2))
    sine, cosine = m[0] * n[1] - m[1] * n[0], m[0] * n[0] + m[1] * n[1]
    right = q[1] - p[1], p[0] - q[0]  # outward, as the body is on the left
    outward = min(m[0] * right[0] + m[1] * right[1], n[0] * right[0] + n[1] * right[1])
    if abs(sine) <= 1e-9 * size or outward <= 0.0:
        return x, y, False
    a, b = m[0] * p[0] + m[1] * p[1], n[0] * q[0] + n[1] * q[1]
    dx, dy = (a * n[1] - b * m[1]) / sine - x, (m[0] * b - n[0] * a) / sine - y
    part = 1.0
    if smooth:
        turn = np.arctan2(abs(sine), cosine)
        half = 0.5 * turn
        part = 2.0 / 3.0
        if turn > FLAT:
            part = 0.5 * (turn - np.sin(turn)) / (np.sin(half) ** 2 * np.tan(half))
    if dx != 0.0:
        part = min(part, ((1.0 if dx > 0.0 else 0.0) - x) / dx)
    if dy != 0.0:
        part = min(part, ((1.0 if dy > 0.0 else 0.0) - y) / dy)
    return x + part * dx, y + part * dy, not smooth


@njit(nogil=True, cache=True)
def closed_face(
    phi: Array, found: Crossings, axis: int, i: int, j: int, k: int, flat: bool, straight: bool
) -> tuple[float, float, float, int, float, float]:
    """Closed part of face (i, j, k) across `axis`, and its moments about its centre along the
    two other axes, in cells; the number of corners of the wall on it, and the sum of their places.

    Corners inside across a diagonal are joined: a thin body stays in one piece. In a slab, `flat`,
    a face across x or y is an edge. A `straight` wall is the chord from crossing to crossing.
    """
    if flat and axis < 2:
        part = 1.0 - open_edge(phi, found, 1 - axis, i, j, k)
        side = 0.5 * (1.0 - part) if phi[i, j, k] >= 0.0 else -0.5 * (1.0 - part)
        return part, part * side, 0.0, 0, 0.0, 0.0
    s, t = other_axes(axis)
    si, sj, ti, tj, tk = int(s == 0), int(s == 1), int(t == 0), int(t == 1), int(t == 2)
    values = (
        phi[i, j, k],
        phi[i + si, j + sj, k],
        phi[i + si + ti, j + sj + tj, k + tk],
        phi[i + ti, j + tj, k + tk],
    )
    begin, inside = -1, 0
    for n in range(4):
        if values[n] < 0.0:
            inside += 1
            begin = n
    if inside == 0:
        return 0.0, 0.0, 0.0, 0, 0.0, 0.0
    if inside == 4:
        return 1.0, 0.0, 0.0, 0, 0.0, 0.0
    at = found.at
    crossing = (
        at[s, i, j, k],
        at[t, i + si, j + sj, k],
        at[s, i + ti, j + tj, k + tk],
        at[t, i, j, k],
    )
    x0, y0 = corner_of(begin)
    origin = x0 - 0.5, y0 - 0.5
    last, p = (0.0, 0.0), (0.0, 0.0)
    normal, piece = (0.0, 0.0), -1
    area, sx, sy, corners, cx, cy = 0.0, 0.0, 0.0, 0, 0.0, 0.0
    for turn in range(begin, begin + 4):
        n, m = turn % 4, (turn + 1) % 4
        for step in range(3):
            if step == 0:  # the corner itself
                if values[n] >= 0.0:
                    continue
                c = corner_of(n)
                x, y = float(c[0]), float(c[1])
            else:
                if (values[n] < 0.0) == (values[m] < 0.0):
                    continue
                leaving = values[n] < 0.0
                if step == 1 and (leaving or straight):
                    continue
                e = crossing[n]
                inner, outer = (n, m) if leaving else (m, n)
                if e >= 0:
                    closed = 1.0 - found.part[e]
                    here = found.normal[e, s], found.normal[e, t]
                    own = found.piece[e]
                else:
                    closed = values[inner] / (values[inner] - values[outer])
                    here, own = (0.0, 0.0), -1
                c, o = corner_of(inner), corner_of(outer)
                qx, qy = c[0] + closed * (o[0] - c[0]), c[1] + closed * (o[1] - c[1])
                if step == 1:  # the wall on the way to where the polygon enters the body again
                    x, y, kink = wall_between(p, (qx, qy), normal, here, own == piece)
                    if kink:
                        corners += 1
                        cx += x
                        cy += y
                else:
                    x, y = qx, qy
                    if leaving:
                        p, normal, piece = (qx, qy), here, own
            x, y = x - x0, y - y0
            cross = last[0] * y - x * last[1]
            area += cross
            sx += cross * (last[0] + x)
            sy += cross * (last[1] + y)
            last = (x, y)
    area *= 0.5
    if area <= 0.0:
        return 0.0, 0.0, 0.0, corners, cx, cy
    sx, sy = sx / 6.0 + area * origin[0], sy / 6.0 + area * origin[1]
    return min(area, 1.0), sx, sy, corners, cx, cy
