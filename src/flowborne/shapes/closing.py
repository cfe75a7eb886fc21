"""Closing the holes of surfaces of triangles."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from flowborne.kernels.arrays import Array, Integers, Mesh
from flowborne.shapes.mesh import welded
from flowborne.shapes.thickness import connected, outward

SMALL_HOLE = 0.05
"""Largest hole, relative to the size of the surface, that is closed by default: open seams, the
back of an eye, the end of a lash."""


def closed(mesh: Mesh, widest: float) -> Mesh | None:
    """A surface with closed holes, oriented outward; None when it stays open.

    widest  largest hole that is closed, relative to the size of the surface
    """
    points, faces = welded(*mesh)
    faces = wound(faces)
    loops = loops_of(rims_of(faces))
    size = float(np.ptp(points, axis=0).max())
    if any(across_of(points[loop]) > widest * size for loop in loops):
        return None
    points, lids = fans(points, loops)
    faces = np.concatenate([faces, lids])
    volume = np.linalg.det(points[faces]).sum()
    if volume < 0.0:
        faces = faces[:, ::-1]
    return (points, faces) if volume else None


def hull(mesh: Mesh) -> Mesh | None:
    """The convex hull of a surface; None for a flat one."""
    vertices, faces = mesh
    points = vertices[np.unique(faces)]
    try:
        found = ConvexHull(points)
    except QhullError:
        return None
    inward = (outward(points[found.simplices]) * found.equations[:, :3]).sum(axis=1) < 0.0
    faces = np.where(inward[:, None], found.simplices[:, ::-1], found.simplices)
    used, number = np.unique(faces, return_inverse=True)
    return points[used], number.reshape(-1, 3)


def open_edges(mesh: Mesh) -> int:
    """Edges of a surface that are not used once in each direction."""
    return len(rims_of(welded(*mesh)[1]))


def is_closed(mesh: Mesh) -> bool:
    """Whether every edge is used once in each direction and the enclosed volume is positive."""
    vertices, faces = mesh
    return open_edges(mesh) == 0 and bool(np.linalg.det(vertices[faces]).sum() > 0.0)


def across_of(rim: Array) -> float:
    """m, twice the largest distance of the points (k, 3) of a rim from their middle."""
    return 2.0 * float(np.linalg.norm(rim - rim.mean(axis=0), axis=1).max())


def fans(points: Array, loops: list[Integers]) -> Mesh:
    """Points and triangles of fans that close rims; the points are followed by the fans' middles.

    loops  numbers of the points along each rim
    """
    corners, lids = [points], [np.zeros((0, 3), np.int64)]
    for rim in loops:
        start, stop = points[rim], points[np.roll(rim, -1)]
        length = np.linalg.norm(stop - start, axis=1)
        tip = np.full(len(rim), len(points) + len(corners) - 1)
        corners.append(np.average(0.5 * (start + stop), axis=0, weights=length)[None])
        lids.append(np.stack([np.roll(rim, -1), rim, tip], axis=1))
    return np.concatenate(corners), np.concatenate(lids)


def edges_of(faces: Integers) -> Integers:
    """(3 m, 2) directed edges of triangles (m, 3): all first ones, then second, then third."""
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])


def wound(faces: Integers) -> Integers:
    """Triangles (m, 3), reversed such that neighbours use common edges in opposite directions.

    In each connected part, fewer than half are reversed. A part that cannot be oriented is left.
    """
    edges = edges_of(faces)
    _, number, uses = np.unique(
        np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    twice = np.flatnonzero(uses[number.ravel()] == 2)
    between = twice[np.argsort(number.ravel()[twice], kind="stable")].reshape(-1, 2)
    alike = edges[between[:, 0], 0] == edges[between[:, 1], 0]
    if not alike.any():
        return faces
    # two nodes per triangle, as given and reversed; edges connect consistent orientations
    count = len(faces)
    first, second = (between % count).T
    start = np.concatenate([first, first + count])
    stop = np.concatenate([second + count * alike, second + count * ~alike])
    part = connected(2 * count, start, stop)
    kept = np.bincount(part[:count], minlength=part.max() + 1)
    flipped = kept[part[count:]] > kept[part[:count]]
    return np.where(flipped[:, None], faces[:, ::-1], faces)


def rims_of(faces: Integers) -> Integers:
    """(k, 2) directed edges that are used less often in the opposite direction."""
    edges = edges_of(faces)
    edges = edges[edges[:, 0] != edges[:, 1]]
    low, high = edges.min(axis=1), edges.max(axis=1)
    points = int(edges.max(initial=0)) + 1
    keys, number = np.unique(low * points + high, return_inverse=True)
    pairs = np.stack(np.divmod(keys, points), axis=1)
    surplus = np.zeros(len(pairs), np.int64)
    np.add.at(surplus, number, np.where(edges[:, 0] == low, 1, -1))
    ahead = np.repeat(pairs, np.maximum(surplus, 0), axis=0)
    back = np.repeat(pairs[:, ::-1], np.maximum(-surplus, 0), axis=0)
    return np.concatenate([ahead, back])


def loops_of(edges: Integers) -> list[Integers]:
    """Closed paths through directed edges (k, 2); as many enter as leave every point."""
    leaving: dict[int, list[int]] = {}
    for start, stop in edges.tolist():
        leaving.setdefault(start, []).append(stop)
    loops = []
    while leaving:
        path = [next(iter(leaving))]
        index = {path[0]: 0}
        while path:
            after = leaving[path[-1]].pop()
            if not leaving[path[-1]]:
                del leaving[path[-1]]
            if after not in index:
                index[after] = len(path)
                path.append(after)
                continue
            loop = path[index[after] :]
            loops.append(np.array(loop))
            for point in loop[1:]:
                del index[point]
            path = path[: index[after] + 1]
            if path[-1] not in leaving:
                break
    return loops
