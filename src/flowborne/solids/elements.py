"""Quadratic simplices (tetrahedra of 10 nodes, in slabs triangles of 6), and surfaces around them.

Nodes are the corners and the middles of the edges. Shape functions in barycentric coordinates L:
L_i (2 L_i - 1) at corners, 4 L_i L_j between them (Zienkiewicz and Taylor, section 8.8).
"""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Integers
from flowborne.shapes.thickness import connected, split_quads

EDGES = {
    3: np.array([[0, 1], [0, 2], [1, 2]]),
    4: np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]),
}
"""Corners at the ends of the edges of a triangle and of a tetrahedron."""

PARTS = {
    6: np.array([[0, 3, 4], [3, 1, 5], [4, 5, 2], [3, 5, 4]]),
    10: np.array(
        [
            [0, 4, 5, 6], [4, 1, 7, 8], [5, 7, 2, 9], [6, 8, 9, 3],
            [4, 5, 6, 8], [4, 7, 5, 8], [5, 9, 6, 8], [5, 7, 9, 8],
        ]
    ),
}  # fmt: skip
"""Nodes of the linear simplices that make up a quadratic one, with its orientation."""

CORNER = {6: 1.0 / 19.0, 10: 1.0 / 36.0}
"""Part of the mass of an element at each corner, from the diagonal of the consistent mass matrix
(Hinton, Rock and Zienkiewicz 1976)."""

CENTRAL = {3: 2.0 / 3.0, 4: 0.25 + 0.15 * np.sqrt(5.0)}
"""Largest barycentric coordinate of each quadrature point; one point per corner, second order."""


def measures(points: Array, simplices: Integers) -> Array:
    """(m,) signed volumes (m^3) of tetrahedra (m, 4) or areas (m^2) of triangles (m, 3) in the
    plane z = 0, of points (n, 3)."""
    corners = points[simplices]
    sides = corners[:, 1:] - corners[:, :1]
    if simplices.shape[1] == 3:
        return np.asarray(0.5 * np.linalg.det(sides[..., :2]))
    return np.asarray(np.linalg.det(sides) / 6.0)


def oriented(points: Array, simplices: Integers) -> Integers:
    """The simplices, with two corners exchanged in those of negative measure."""
    left = measures(points, simplices) < 0.0
    swapped = np.concatenate([simplices[:, :-2], simplices[:, :-3:-1]], axis=1)
    return np.where(left[:, None], swapped, simplices)


def with_middles(count: int, simplices: Integers) -> tuple[Integers, Integers]:
    """Quadratic elements of simplices of `count` points.

    returns  (e, 2) ends of the edges; their middles follow the points in the list of nodes.
             (m, 6) or (m, 10) nodes of the elements
    """
    ends = np.sort(simplices[:, EDGES[simplices.shape[1]]], axis=2)
    edges, middle = np.unique(ends.reshape(-1, 2), axis=0, return_inverse=True)
    middles = count + middle.reshape(len(simplices), -1)
    return edges, np.concatenate([simplices, middles], axis=1)


def parts(elements: Integers) -> Integers:
    """Linear simplices of the nodes, element after element."""
    split = PARTS[elements.shape[1]]
    return np.asarray(elements[:, split].reshape(-1, split.shape[1]))


def corners(elements: Integers) -> Integers:
    """(m, 3) or (m, 4) the corners of quadratic elements."""
    return np.asarray(elements[:, : 3 if elements.shape[1] == 6 else 4])


def lumped(points: Array, elements: Integers) -> Array:
    """(n,) volume (m^3, m^2 of triangles) of each node (n, 3)."""
    volume, own = measures(points, corners(elements)), CORNER[elements.shape[1]]
    at_corners = corners(elements).shape[1]
    share = np.full(elements.shape[1], own)
    share[at_corners:] = (1.0 - at_corners * own) / (elements.shape[1] - at_corners)
    found = np.bincount(elements.ravel(), np.outer(volume, share).ravel(), len(points))
    return np.asarray(found, dtype=np.float64)


def shape_gradients(points: Array, elements: Integers) -> tuple[Array, Array]:
    """Gradients (m, q + 1, k, 3) of the shape functions at q quadrature points and at the centroid,
    1/m; volume (m,) of the elements, m^3, or m^2 of triangles."""
    simplices = corners(elements)
    count = simplices.shape[1]
    sides = (points[simplices[:, 1:]] - points[simplices[:, :1]])[..., : count - 1]
    slope = np.zeros((len(elements), count, 3))
    slope[:, 1:, : count - 1] = np.swapaxes(np.linalg.inv(sides), 1, 2)
    slope[:, 0] = -slope[:, 1:].sum(axis=1)
    other = (1.0 - CENTRAL[count]) / (count - 1)
    L = np.full((count + 1, count), other)
    L[:count] += (CENTRAL[count] - other) * np.eye(count)
    L[count] = 1.0 / count
    i, j = EDGES[count].T
    at_corners = (4.0 * L - 1.0)[None, :, :, None] * slope[:, None]
    between = 4.0 * (
        L[None, :, i, None] * slope[:, None, j] + L[None, :, j, None] * slope[:, None, i]
    )
    return np.concatenate([at_corners, between], axis=2), measures(points, simplices)


def prism(triangles: Integers, count: int) -> Integers:
    """(k, 3) outward surface of a prism over triangles (m, 3) of `count` nodes.

    Its vertices are the nodes at the lower end, then those at the upper end.
    """
    a, b = unshared(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)).T
    walls = split_quads(a, b, b + count, a + count)
    return np.concatenate([triangles[:, ::-1], triangles + count, walls])


def surface_of(elements: Integers) -> Integers:
    """(k, 3) outward faces of right-handed tetrahedra (m, 4) that belong to only one of them."""
    corners = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
    return unshared(elements[:, corners].reshape(-1, 3))


def unshared(faces: Integers) -> Integers:
    """The faces, or edges, (k, n) that have the corners of no other one, in their order."""
    corners = np.sort(faces, axis=1)
    _, first, count = np.unique(corners, axis=0, return_index=True, return_counts=True)
    return np.asarray(faces[np.sort(first[count == 1])])


def outer_surface(points: Array, elements: Integers) -> Integers:
    """(k, 3) outward triangles around tetrahedra (m, 4) of points (n, 3), without those of holes.

    Enclosed space, mostly bones, counts as inside. A sheet is a set of triangles connected by
    edges: where flesh is thin, the sheet around a bone may share corners with the outer sheet.
    """
    triangles = surface_of(elements)
    count = len(triangles)
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, edge, around = np.unique(edges, axis=0, return_inverse=True, return_counts=True)
    by_edge = np.argsort(edge, kind="stable")
    of_two = around[edge[by_edge]] == 2  # an edge along which sheets touch has four triangles
    one, other = (by_edge[of_two] // 3).reshape(-1, 2).T
    sheet = connected(count, one, other)
    enclosed = np.bincount(sheet, np.linalg.det(points[triangles]))
    return np.asarray(triangles[enclosed[sheet] > 0.0])
