"""Surfaces of triangles with holes, and how they are closed."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull, QhullError

from flowborne.shapes.mesh import welded
from flowborne.shapes.shape import Array, Integers, Mesh

SMALL_HOLE = 0.05
"""Part of the surface's size that a hole may be across to be closed without being asked for: seams
that do not meet, the back of an eye, the end of a lash."""


def closed(mesh: Mesh, widest: float) -> Mesh | None:
    """A surface with its holes closed and all of it outward; None where it stays open.

    widest  holes up to this part of its size across are closed
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
    """The convex hull of a surface; None of one that is flat."""
    vertices, faces = mesh
    points = vertices[np.unique(faces)]
    try:
        found = ConvexHull(points)
    except QhullError:
        return None
    corners = points[found.simplices]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = (normal * found.equations[:, :3]).sum(axis=1) < 0.0
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
    """Fans about their middles that close rims, which are points followed by those middles.

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
    """(3 m, 2) directed edges of triangles (m, 3): the first of each, the second, the third."""
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])


def wound(faces: Integers) -> Integers:
    """Triangles (m, 3) of which fewer than half in each connected part are turned over, so that
    neighbours use the edge between them in opposite directions, where that can be."""
    edges = edges_of(faces)
    _, number, uses = np.unique(
        np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    twice = np.flatnonzero(uses[number.ravel()] == 2)
    between = twice[np.argsort(number.ravel()[twice], kind="stable")].reshape(-1, 2)
    alike = edges[between[:, 0], 0] == edges[between[:, 1], 0]
    if not alike.any():
        return faces
    # each triangle stands twice, as it is and turned over: a part and its reverse are connected
    count = len(faces)
    first, second = (between % count).T
    start = np.concatenate([first, first + count])
    stop = np.concatenate([second + count * alike, second + count * ~alike])
    links = coo_array((np.ones(len(start)), (start, stop)), shape=(2 * count, 2 * count))
    part = np.asarray(connected_components(links, directed=False)[1])
    kept = np.bincount(part[:count], minlength=part.max() + 1)
    turned = kept[part[count:]] > kept[part[:count]]
    return np.where(turned[:, None], faces[:, ::-1], faces)


def rims_of(faces: Integers) -> Integers:
    """(k, 2) directed edges that are not used as often in the other direction."""
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
    """Closed ways through directed edges (k, 2) of which as many enter as leave every point."""
    leaving: dict[int, list[int]] = {}
    for start, stop in edges.tolist():
        leaving.setdefault(start, []).append(stop)
    loops = []
    while leaving:
        way = [next(iter(leaving))]
        place = {way[0]: 0}
        while way:
            after = leaving[way[-1]].pop()
            if not leaving[way[-1]]:
                del leaving[way[-1]]
            if after not in place:
                place[after] = len(way)
                way.append(after)
                continue
            loop = way[place[after] :]
            loops.append(np.array(loop))
            for point in loop[1:]:
                del place[point]
            way = way[: place[after] + 1]
            if way[-1] not in leaving:
                break
    return loops
