"""The point of a triangle that is closest to a place."""

from __future__ import annotations

from numba import njit

from flowborne.kernels.arrays import Point


@njit(nogil=True, cache=True)
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


@njit(nogil=True, cache=True)
def squared_distance(p: Point, a: Point, b: Point, c: Point, weights: Point) -> float:
    """Square of the distance from p to the point of the triangle with the given weights."""
    total = 0.0
    for m in range(3):
        away = weights[0] * (a[m] - p[m]) + weights[1] * (b[m] - p[m]) + weights[2] * (c[m] - p[m])
        total += away * away
    return total
