"""Skins, of flesh or of the model, as smooth surfaces that deform from frame to frame."""

from __future__ import annotations

import numpy as np
import pyvista as pv
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from flowborne.shapes.shape import unit
from flowborne.view import style
from flowborne.view.run import Skin, State
from flowborne.view.space.shapes import LIT

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

CREASE = 60.0
"""Angle between two triangles at first from which on their edge is seen, degrees."""


class SkinSurface:
    """A skin in a plotter."""

    def __init__(
        self, plotter: pv.Plotter, skin: Skin, first: State, *, seen_through: bool
    ) -> None:
        """`first`: the state that says where there are edges to be seen."""
        self._skin, vertices = skin, skin.vertices(first)
        self._vertex, self._faces = creased(vertices, skin.triangles)
        points = vertices[self._vertex]
        self._mesh = pv.PolyData.from_regular_faces(points, self._faces)
        self._mesh.point_data.active_normals = normals(points, self._faces)
        self._actor = plotter.add_mesh(
            self._mesh,
            color=skin.rgb,
            opacity=style.SEEN_THROUGH if seen_through else 1.0,
            culling="back" if seen_through else None,
            **LIT,
        )

    def show(self, state: State) -> Array:
        """Show the skin; one whose numbers are lost is not seen. (m, 3, 3) m, the corners of its
        triangles."""
        vertices = self._skin.vertices(state)
        self._actor.visibility = bool(np.isfinite(vertices).all())
        if self._actor.visibility:
            points = vertices[self._vertex]
            self._mesh.points = points
            self._mesh.point_data.active_normals[:] = normals(points, self._faces)
            self._mesh.Modified()
        return np.asarray(vertices[self._skin.triangles])


def creased(vertices: Array, triangles: Indices) -> tuple[Indices, Indices]:
    """The vertex (n,) of each point of a surface, and its triangles (m, 3) of points.

    A vertex on a crease has a point, and so a normal, on each side of it.

    vertices   (k, 3) m;  triangles  (m, 3) of them
    """
    faces = np.arange(triangles.size).reshape(-1, 3)
    edges = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2)
    corners = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)
    order = np.lexsort(np.sort(edges, axis=1).T)
    here, there = order[:-1], order[1:]
    facing = unit(_across(vertices[triangles]))
    joined = (edges[here] == edges[there][:, ::-1]).all(axis=1)
    joined &= (facing[here // 3] * facing[there // 3]).sum(axis=1) > np.cos(np.radians(CREASE))
    here, there = here[joined], there[joined]
    # the two triangles of an edge go along it in opposite directions
    pairs = np.concatenate([corners[here], corners[there][:, ::-1]], axis=1)
    first, second = pairs[:, :2].ravel(), pairs[:, 2:].ravel()
    graph = coo_array((np.ones(first.size), (first, second)), shape=2 * (triangles.size,))
    count, point = connected_components(graph, directed=False)
    vertex = np.empty(count, np.int64)
    vertex[point] = triangles.ravel()
    return vertex, point.reshape(-1, 3).astype(np.int64)


def normals(points: Array, triangles: Indices) -> Array:
    """(n, 3) mean normal of the triangles (m, 3) around each point, weighted by their areas."""
    total = np.zeros((len(points), 3))
    np.add.at(total, triangles, _across(points[triangles])[:, None])
    return unit(total)


def _across(corners: Array) -> Array:
    """(m, 3) normals of triangles with corners (m, 3, 3), as long as twice their areas."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def way_out(place: Array, along: Array, corners: Array) -> float:
    """m along the unit vector `along` (3,) from `place` (3,) to where it leaves a closed skin of
    triangles with corners (m, 3, 3) m; 0 from outside it (Moeller and Trumbore 1997)."""
    known = corners[np.isfinite(corners).all(axis=(1, 2))]
    slope = _across(known) @ along
    crossed, slope = known[slope != 0.0], slope[slope != 0.0]
    first = crossed[:, 0] - place
    one, other = crossed[:, 1] - crossed[:, 0], crossed[:, 2] - crossed[:, 0]
    turn = np.cross(first, along)
    u, v = (turn * other).sum(axis=1) / slope, -(turn * one).sum(axis=1) / slope
    distance = (first * _across(crossed)).sum(axis=1) / slope
    met = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (distance > 0.0)
    if not met.any():
        return 0.0
    nearest = np.flatnonzero(met)[np.argmin(distance[met])]
    return float(distance[nearest]) if slope[nearest] > 0.0 else 0.0
