"""Volume that each body displaces: closed forms, less what a body's own geometries share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flowborne.solids.slab import Mesh

Array = NDArray[np.float64]

COLUMNS = 200
"""Columns along each side of the quadrature of a shared volume."""

SLAB_COLUMNS = 4000
"""Columns of the quadrature of a shared cross-section."""


@dataclass(frozen=True)
class Solid:
    """One geometry as the quadrature sees it.

    kind      "sphere", "capsule", "cylinder", "box", "ellipsoid" or "mesh"
    size      (3,) MuJoCo's half sizes, m
    position  (3,) centre in the frame of the quadrature, m
    rotation  (3, 3) to the frame of the quadrature
    low, high (3,) corners of a box around it in the frame of the quadrature
    mesh      vertices in the geometry's frame and faces, for a mesh
    volume    volume, m^3 (cross-section in a slab, m^2)
    centroid  (3,) in the frame of the quadrature, m
    """

    kind: str
    size: Array
    position: Array
    rotation: Array
    low: Array
    high: Array
    mesh: Mesh | None
    volume: float
    centroid: Array


def volume(kind: str, size: Array, mesh: Mesh | None) -> float:
    """Volume of a geometry, m^3; closed forms, and the divergence theorem for a mesh."""
    a, b, c = (float(s) for s in size)
    if kind == "sphere":
        return 4.0 / 3.0 * np.pi * a**3
    if kind == "capsule":
        return 2.0 * np.pi * a**2 * b + 4.0 / 3.0 * np.pi * a**3
    if kind == "cylinder":
        return 2.0 * np.pi * a**2 * b
    if kind == "box":
        return 8.0 * a * b * c
    if kind == "ellipsoid":
        return 4.0 / 3.0 * np.pi * a * b * c
    return float(_tetrahedra(mesh)[1].sum())


def centroid(mesh: Mesh | None) -> Array:
    """(3,) centroid of a geometry in its own frame: the origin, except for a mesh."""
    if mesh is None:
        return np.zeros(3)
    corners, volumes = _tetrahedra(mesh)
    return np.asarray((volumes[:, None] * corners.sum(axis=1) / 4.0).sum(axis=0) / volumes.sum())


def _tetrahedra(mesh: Mesh | None) -> tuple[Array, Array]:
    """Triangles (m, 3, 3) and signed volumes (m,) of the tetrahedra they span with the origin."""
    if mesh is None:
        raise ValueError("mesh has no triangles")
    corners = mesh[0][mesh[1]]
    return corners, np.linalg.det(corners) / 6.0


def united(solids: list[Solid], slab: bool) -> tuple[float, Array]:
    """Volume and centroid of the union of the geometries of one body.

    Geometries that share no space add up exactly. What several of them share (the joints of a
    curved bone made of capsules) would be counted more than once: it is measured along a fixed
    lattice of parallel lines, exactly along each line, and taken away. The lines are 200 x 200
    over the shared region (4000 in a slab), which leaves a relative error of some 1e-4 of the
    shared part (1e-5 in a slab).

    returns   volume in m^3 and (3,) centroid in the frame of the solids
    """
    total = sum(s.volume for s in solids)
    moment = np.sum([s.volume * s.centroid for s in solids], axis=0)
    region = _shared_region(solids)
    if region is not None:
        origins, direction, weight = _lines(*region, slab)
        crossings = [_crossings(s, origins, direction) for s in solids]
        shared, first = _excess(crossings, origins, direction)
        total -= weight * shared
        moment = moment - weight * first
    return float(total), moment / total


def _shared_region(solids: list[Solid]) -> tuple[Array, Array] | None:
    """Box around every overlap of two bounding boxes, or None when there is none."""
    lows, highs = [], []
    for i, a in enumerate(solids):
        for b in solids[:i]:
            low, high = np.maximum(a.low, b.low), np.minimum(a.high, b.high)
            if np.all(high > low):
                lows.append(low)
                highs.append(high)
    if not lows:
        return None
    return np.min(lows, axis=0), np.max(highs, axis=0)


def _lines(low: Array, high: Array, slab: bool) -> tuple[Array, Array, float]:
    """Origins (n, 3), direction (3,) and measure of one of the lines through the region."""
    if slab:
        step = (high[0] - low[0]) / SLAB_COLUMNS
        x = low[0] + step * (np.arange(SLAB_COLUMNS) + 0.5)
        zero = np.zeros_like(x)
        return np.stack([x, zero, zero], axis=1), np.array([0.0, 1.0, 0.0]), float(step)
    step = (high - low) / COLUMNS
    ticks = np.arange(COLUMNS) + 0.5
    x, y = np.meshgrid(low[0] + step[0] * ticks, low[1] + step[1] * ticks, indexing="ij")
    origins = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    return origins, np.array([0.0, 0.0, 1.0]), float(step[0] * step[1])


def _excess(
    crossings: list[tuple[NDArray[np.int64], Array, Array]], origins: Array, direction: Array
) -> tuple[float, Array]:
    """Length along all lines counted more than once, and its first moment (3,)."""
    line = np.concatenate([c[0] for c in crossings])
    at = np.concatenate([c[1] for c in crossings])
    order = np.lexsort((at, line))
    line, at = line[order], at[order]
    inside = np.cumsum(np.concatenate([c[2] for c in crossings])[order])[:-1]
    surplus = np.where(line[1:] == line[:-1], np.maximum(inside - 1.0, 0.0), 0.0)
    length = surplus * (at[1:] - at[:-1])
    middle = origins[line[:-1]] + 0.5 * (at[1:] + at[:-1])[:, None] * direction
    return float(length.sum()), np.asarray((length[:, None] * middle).sum(axis=0))


def _crossings(
    solid: Solid, origins: Array, direction: Array
) -> tuple[NDArray[np.int64], Array, Array]:
    """Where lines enter (+1) and leave (-1) a geometry: line numbers, places, signs."""
    o = (origins - solid.position) @ solid.rotation
    d = direction @ solid.rotation
    if solid.kind == "mesh":
        return _mesh_crossings(solid.mesh, o, d)
    enter, leave = _interval(solid.kind, solid.size, o, d)
    hit = np.flatnonzero(leave > enter)
    one = np.ones(hit.size)
    return np.tile(hit, 2), np.concatenate([enter[hit], leave[hit]]), np.concatenate([one, -one])


def _interval(kind: str, size: Array, o: Array, d: Array) -> tuple[Array, Array]:
    """Part (enter, leave) of each line o + t d in a convex geometry; leave < enter outside."""
    if kind == "box":
        return _between(o, d, size)
    if kind in ("sphere", "ellipsoid"):
        semi = np.full(3, size[0]) if kind == "sphere" else size
        return _quadratic(o / semi, d / semi)
    enter, leave = _quadratic(o[:, :2] / size[0], d[:2] / size[0])
    low, high = _between(o[:, 2:], d[2:], size[1:2])
    enter, leave = np.maximum(enter, low), np.minimum(leave, high)
    if kind == "cylinder":
        return enter, leave
    gone = leave <= enter
    enter, leave = np.where(gone, np.inf, enter), np.where(gone, -np.inf, leave)
    for end in (-size[1], size[1]):
        low, high = _quadratic((o - [0.0, 0.0, end]) / size[0], d / size[0])
        enter, leave = np.minimum(enter, low), np.maximum(leave, high)
    return enter, leave


def _between(o: Array, d: Array, half: Array) -> tuple[Array, Array]:
    """Part of each line where |o + t d| <= half in every component."""
    enter, leave = np.full(len(o), -np.inf), np.full(len(o), np.inf)
    for k in range(o.shape[1]):
        if abs(d[k]) > 1e-12:
            ends = np.stack([-half[k] - o[:, k], half[k] - o[:, k]]) / d[k]
            enter = np.maximum(enter, ends.min(axis=0))
            leave = np.minimum(leave, ends.max(axis=0))
        else:
            enter = np.where(np.abs(o[:, k]) < half[k], enter, np.inf)
            leave = np.where(np.abs(o[:, k]) < half[k], leave, -np.inf)
    return enter, leave


def _quadratic(o: Array, d: Array) -> tuple[Array, Array]:
    """Part of each line where |o + t d| <= 1; all of it, or nothing, for d = 0."""
    a, b, c = float(d @ d), o @ d, (o * o).sum(axis=1) - 1.0
    if a < 1e-24:
        return np.where(c < 0.0, -np.inf, np.inf), np.where(c < 0.0, np.inf, -np.inf)
    root = b * b - a * c
    width = np.sqrt(np.maximum(root, 0.0))
    return (
        np.where(root > 0.0, (-b - width) / a, np.inf),
        np.where(root > 0.0, (-b + width) / a, -np.inf),
    )


def _mesh_crossings(
    mesh: Mesh | None, o: Array, d: Array
) -> tuple[NDArray[np.int64], Array, Array]:
    """As `_crossings`, triangle by triangle (Moeller and Trumbore 1997)."""
    corners = _tetrahedra(mesh)[0]
    lines, places, signs = [], [], []
    for first, second, third in corners:
        e1, e2 = second - first, third - first
        p = np.cross(d, e2)
        determinant = float(e1 @ p)
        if abs(determinant) < 1e-300:
            continue
        s = o - first
        u = s @ p / determinant
        q = np.cross(s, e1)
        v = q @ d / determinant
        hit = np.flatnonzero((u >= 0.0) & (v >= 0.0) & (u + v < 1.0))
        lines.append(hit)
        places.append(q[hit] @ e2 / determinant)
        signs.append(np.full(hit.size, np.sign(determinant)))
    return np.concatenate(lines), np.concatenate(places), np.concatenate(signs)
