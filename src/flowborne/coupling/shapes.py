"""Signed distance to the geometries that a body is made of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from flowborne.coupling.triangles import closest_on_triangle, squared_distance
from flowborne.fluid.grid import Array, Grid
from flowborne.solids.model import SolidModel

SPHERE, CAPSULE, CYLINDER, BOX, ELLIPSOID, MESH = range(6)

ENDLESS = 1e30
"""Half extent along z of a geometry's cross-section in a slab, in m."""

WATERTIGHT = {True: np.sqrt(2.0) / 2.0 * 1.01, False: np.sqrt(3.0) / 2.0 * 1.01}
"""Half thickness, in cells, from which a sheet blocks every face it passes (slab or not).

A sheet holds an unbroken chain of closed faces at every angle when it is as thick as the diagonal
of a cell. A thinner body is seen by the fluid as that thick; its mass and its displaced volume
stay its own.
"""


@dataclass(frozen=True)
class Shapes:
    """Geometries as the grid sees them, each in its own frame.

    kind    (ng,) SPHERE .. MESH
    size    (ng, 3) half extents in m: radius first, half length second for capsule and cylinder
    reach   (ng, 3) half extents of the bounding box in the geometry's frame, m
    body    (ng,) body that the geometry belongs to, ascending
    source  (ng,) index of the geometry in the model
    tables  samples of the distance to each mesh, flat, one after another
    table   (ng, 4) first sample, then counts along x, y, z
    corner  (ng, 3) first sample's place in the geometry's frame, m
    pitch   (ng,) distance between samples, m
    """

    kind: NDArray[np.int64]
    size: Array
    reach: Array
    body: NDArray[np.int64]
    source: NDArray[np.int64]
    tables: Array
    table: NDArray[np.int64]
    corner: Array
    pitch: Array


@njit(nogil=True, cache=True, inline="never")
def distance_to_box(x: float, y: float, z: float, a: float, b: float, c: float) -> float:
    """Signed distance of (x, y, z) to the box of half extents a, b, c."""
    dx, dy, dz = abs(x) - a, abs(y) - b, abs(z) - c
    outside = np.sqrt(max(dx, 0.0) ** 2 + max(dy, 0.0) ** 2 + max(dz, 0.0) ** 2)
    return float(outside + min(max(dx, dy, dz), 0.0))


@njit(nogil=True, cache=True, inline="never")
def distance_to_ellipsoid(x: float, y: float, z: float, a: float, b: float, c: float) -> float:
    """Distance to the ellipsoid of semi-axes a, b, c, exact to first order at the surface."""
    k0 = np.sqrt((x / a) ** 2 + (y / b) ** 2 + (z / c) ** 2)
    k1 = np.sqrt((x / a**2) ** 2 + (y / b**2) ** 2 + (z / c**2) ** 2)
    if k1 == 0.0:
        return float(-min(a, b, c))
    return float(k0 * (k0 - 1.0) / k1)


@njit(nogil=True, cache=True, inline="never")
def distance_in_table(
    x: float,
    y: float,
    z: float,
    tables: Array,
    table: NDArray[np.int64],
    corner: Array,
    pitch: float,
) -> float:
    """Trilinear sample of a table of distances; beyond the table the way to it is added."""
    n1, n2, n3 = table[1], table[2], table[3]
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
                value += weight * tables[table[0] + ((i + di) * n2 + j + dj) * n3 + k + dk]
    return float(value + away)


@njit(nogil=True, cache=True)
def signed_distance(
    kind: int,
    size: Array,
    x: float,
    y: float,
    z: float,
    tables: Array,
    table: NDArray[np.int64],
    corner: Array,
    pitch: float,
) -> float:
    """Signed distance of a point in the geometry's frame, negative inside, m."""
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
    return distance_in_table(x, y, z, tables, table, corner, pitch)


@njit(nogil=True, cache=True)
def sample_mesh(
    vertices: Array, faces: NDArray[np.int64], corner: Array, pitch: float, counts: Array
) -> Array:
    """Signed distance to a closed mesh on a lattice; the sign is that of the winding number
    (van Oosterom and Strackee 1983)."""
    n1, n2, n3 = int(counts[0]), int(counts[1]), int(counts[2])
    samples = np.empty(n1 * n2 * n3)
    p = np.empty(3)
    for i in range(n1):
        for j in range(n2):
            for k in range(n3):
                p[0] = corner[0] + pitch * i
                p[1] = corner[1] + pitch * j
                p[2] = corner[2] + pitch * k
                nearest, angle = 1e30, 0.0
                for t in range(faces.shape[0]):
                    a, b, c = vertices[faces[t, 0]], vertices[faces[t, 1]], vertices[faces[t, 2]]
                    closest = closest_on_triangle(p, a, b, c)
                    nearest = min(nearest, squared_distance(p, a, b, c, closest))
                    u, v, w = a - p, b - p, c - p
                    lu, lv, lw = np.sqrt(u.dot(u)), np.sqrt(v.dot(v)), np.sqrt(w.dot(w))
                    triple = (
                        u[0] * (v[1] * w[2] - v[2] * w[1])
                        + u[1] * (v[2] * w[0] - v[0] * w[2])
                        + u[2] * (v[0] * w[1] - v[1] * w[0])
                    )
                    below = lu * lv * lw + u.dot(v) * lw + v.dot(w) * lu + w.dot(u) * lv
                    angle += 2.0 * np.arctan2(triple, below)
                away = np.sqrt(nearest)
                samples[(i * n2 + j) * n3 + k] = -away if angle > 2.0 * np.pi else away
    return samples


MESH_SAMPLES = 40
"""Samples of a mesh's distance table along its longest side."""


def shapes(model: SolidModel, grid: Grid) -> Shapes:
    """Geometries of `model` as `grid` sees them: thickened to be watertight, endless in a slab."""
    thinnest = WATERTIGHT[grid.is_slab] * grid.spacing
    order = np.argsort(model.geom_body, kind="stable")
    kinds = {"sphere": 0, "capsule": 1, "cylinder": 2, "box": 3, "ellipsoid": 4, "mesh": 5}
    chosen = [int(g) for g in order if model.geom_type[g] in kinds and not model.geom_covered[g]]
    count = len(chosen)
    kind = np.zeros(count, np.int64)
    size, reach = np.ones((count, 3)), np.ones((count, 3))
    table, corner, pitch = np.zeros((count, 4), np.int64), np.zeros((count, 3)), np.ones(count)
    tables: list[Array] = []
    first = 0
    rest = model.rest_geom_rotation()
    for n, g in enumerate(chosen):
        kind[n] = kinds[str(model.geom_type[g])]
        size[n] = np.maximum(model.geom_size[g], thinnest)
        if kind[n] == SPHERE:
            reach[n] = size[n, 0]
        elif kind[n] == CAPSULE:
            size[n, 1] = model.geom_size[g, 1]
            reach[n] = size[n, 0], size[n, 0], size[n, 0] + size[n, 1]
        elif kind[n] == CYLINDER:
            reach[n] = size[n, 0], size[n, 0], size[n, 1]
        elif kind[n] == MESH:
            vertices, faces = model.mesh_of(g)
            low, high = vertices.min(axis=0), vertices.max(axis=0)
            pitch[n] = float((high - low).max()) / MESH_SAMPLES
            corner[n] = low - 3.0 * pitch[n]
            counts = np.ceil((high - low) / pitch[n]) + 7.0
            tables.append(sample_mesh(vertices, faces, corner[n], pitch[n], counts))
            table[n] = first, *counts.astype(np.int64)
            first += tables[-1].size
            reach[n] = np.maximum(np.abs(low), np.abs(high))
        else:
            reach[n] = size[n]
        if grid.is_slab:
            upright = int(np.argmax(np.abs(rest[g][2])))
            if kind[n] in (BOX, ELLIPSOID):
                size[n, upright] = ENDLESS
            elif kind[n] == CYLINDER and upright == 2:
                size[n, 1] = ENDLESS
    return Shapes(
        kind,
        size,
        reach,
        np.asarray(model.geom_body)[chosen].astype(np.int64),
        np.array(chosen, np.int64),
        np.concatenate(tables) if tables else np.zeros(1),
        table,
        corner,
        pitch,
    )
