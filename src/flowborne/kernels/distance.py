"""Signed distance to a primitive geometry, or to samples of one."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flowborne.kernels.arrays import Array, Point
from flowborne.kernels.jit import kernel

SPHERE, CAPSULE, CYLINDER, BOX, ELLIPSOID, MESH = range(6)


class Samples(NamedTuple):
    """Distances on a lattice in the frame of a shape.

    corner  (3,) position of the first sample, m
    pitch   spacing, m
    values  (nx, ny, nz) m
    """

    corner: Array
    pitch: float
    values: Array


@kernel
def distance_to_box(x: float, y: float, z: float, a: float, b: float, c: float) -> float:
    """Signed distance of (x, y, z) to the box of half extents a, b, c."""
    dx, dy, dz = abs(x) - a, abs(y) - b, abs(z) - c
    outside = np.sqrt(max(dx, 0.0) ** 2 + max(dy, 0.0) ** 2 + max(dz, 0.0) ** 2)
    return float(outside + min(max(dx, dy, dz), 0.0))


@kernel
def distance_to_ellipsoid(x: float, y: float, z: float, a: float, b: float, c: float) -> float:
    """Distance to the ellipsoid of semi-axes a, b, c, exact to first order at the surface."""
    k0 = np.sqrt((x / a) ** 2 + (y / b) ** 2 + (z / c) ** 2)
    k1 = np.sqrt((x / a**2) ** 2 + (y / b**2) ** 2 + (z / c**2) ** 2)
    if k1 == 0.0:
        return float(-min(a, b, c))
    return float(k0 * (k0 - 1.0) / k1)


@kernel
def distance_in_samples(x: float, y: float, z: float, samples: Samples) -> float:
    """Linear between samples of a distance; beyond them the way to them is added."""
    corner, pitch, values = samples
    n1, n2, n3 = values.shape
    fx = (x - corner[0]) / pitch
    fy = (y - corner[1]) / pitch
    fz = (z - corner[2]) / pitch
    cx = min(max(fx, 0.0), n1 - 1.001)
    cy = min(max(fy, 0.0), n2 - 1.001)
    cz = min(max(fz, 0.0), n3 - 1.001)
    away = pitch * np.sqrt((fx - cx) ** 2 + (fy - cy) ** 2 + (fz - cz) ** 2)
    i, j, k = int(cx), int(cy), int(cz)
    tx, ty, tz = cx - i, cy - j, cz - k
    value = 0.0
    for di in range(2):
        for dj in range(2):
            for dk in range(2):
                weight = (
                    (tx if di else 1.0 - tx) * (ty if dj else 1.0 - ty) * (tz if dk else 1.0 - tz)
                )
                value += weight * values[i + di, j + dj, k + dk]
    return float(value + away)


@kernel
def signed_distance(kind: int, size: Array, point: Point, samples: Samples) -> float:
    """Signed distance of a point in the geometry's frame, negative inside, m."""
    x, y, z = point
    if kind == SPHERE:
        return float(np.sqrt(x * x + y * y + z * z) - size[0])
    if kind == CAPSULE:
        along = z - min(max(z, -size[1]), size[1])
        return float(np.sqrt(x * x + y * y + along * along) - size[0])
    if kind == CYLINDER:
        dr, dz = np.sqrt(x * x + y * y) - size[0], abs(z) - size[1]
        return float(np.sqrt(max(dr, 0.0) ** 2 + max(dz, 0.0) ** 2) + min(max(dr, dz), 0.0))
    if kind == BOX:
        return distance_to_box(x, y, z, size[0], size[1], size[2])
    if kind == ELLIPSOID:
        return distance_to_ellipsoid(x, y, z, size[0], size[1], size[2])
    return distance_in_samples(x, y, z, samples)


@kernel
def distances(kind: int, size: Array, points: Array) -> Array:
    """(n,) signed distances of points (n, 3) in the geometry's frame, exact for an ellipsoid, m."""
    none, distance = Samples(np.zeros(3), 1.0, np.zeros((1, 1, 1))), np.empty(len(points))
    for i in range(len(points)):
        if kind == ELLIPSOID:
            distance[i] = distance_off_ellipsoid(points[i], size)
        else:
            point = points[i, 0], points[i, 1], points[i, 2]
            distance[i] = signed_distance(kind, size, point, none)
    return distance


@kernel
def distance_off_ellipsoid(point: Array, semi: Array) -> float:
    """Signed distance of a point to an ellipsoid about the origin, m (Eberly 2013).

    The nearest point is semi^2 point / (t + semi^2) for the largest root t of the ellipsoid's
    equation. That is convex above -min(semi)^2, so Newton's method climbs to it from below.
    """
    least = semi.min()
    place = np.maximum(np.abs(point), 1e-9 * least)
    t = (semi * (place - semi)).max()
    for _ in range(100):
        ratio = semi * place / (t + semi**2)
        excess = (ratio**2).sum() - 1.0
        step = 0.5 * excess / (ratio**2 / (t + semi**2)).sum()
        t += step
        if step <= 1e-14 * least**2:
            break
    offset = place * t / (t + semi**2)
    return float(np.sign(t) * np.sqrt((offset**2).sum()))
