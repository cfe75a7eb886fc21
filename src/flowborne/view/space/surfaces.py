"""Surfaces of bodies and skins as meshes, and where a line leaves them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyvista as pv
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from flowborne.kernels.arrays import Array, Integers
from flowborne.shapes.shape import unit
from flowborne.view import style
from flowborne.view.glyphs import Forces
from flowborne.view.run import Geom, Skin, State

SHARP = 35.0
"""Angle between two faces above which their edge is sharp, degrees."""

UNCOLOURED = (0.5, 0.5, 0.5, 1.0)
"""MuJoCo's default colour, of a geometry without one in the model."""

LIT: dict[str, Any] = {
    "ambient": 0.22,
    "diffuse": 0.82,
    "specular": 0.12,
    "specular_power": 18.0,
    "interpolation": "phong",
}
"""Material of bodies and flesh."""

CREASE = 60.0
"""Angle between two triangles of a skin at first above which their edge is sharp, degrees."""


def mesh_of(geom: Geom) -> pv.PolyData:
    """Surface of a geometry in its own frame, m, with normals for shading."""
    return pv.PolyData.from_regular_faces(*geom.shape.triangles()).compute_normals(
        feature_angle=SHARP, split_vertices=True, consistent_normals=False
    )


def colour_of(geom: Geom, accented: frozenset[int]) -> tuple[Array, float]:
    """(3,) colour of a geometry and its opacity, from 0 to 1.

    The colour is the model's unless the geometry is fixed, accented or has none.
    """
    rgba = np.round(geom.rgba, 6)
    plain = tuple(rgba) == UNCOLOURED or geom.body == 0 or geom.body in accented
    colour = style.rgb(style.body_colour(geom.body, accented)) if plain else rgba[:3]
    return colour, float(geom.rgba[3])


class SkinSurface:
    """A skin, of flesh or of the model, in a plotter."""

    def __init__(
        self, plotter: pv.Plotter, skin: Skin, first: State, *, seen_through: bool
    ) -> None:
        """`first`: state that defines the sharp edges."""
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
        """Show the skin unless its vertices are not finite; returns the corners (m, 3, 3) of its
        triangles, m."""
        vertices = self._skin.vertices(state)
        self._actor.visibility = bool(np.isfinite(vertices).all())
        if self._actor.visibility:
            points = vertices[self._vertex]
            self._mesh.points = points
            self._mesh.point_data.active_normals[:] = normals(points, self._faces)
            self._mesh.Modified()
        return np.asarray(vertices[self._skin.triangles])


def creased(vertices: Array, triangles: Integers) -> tuple[Integers, Integers]:
    """The vertex (n,) of each point of a surface, and its triangles (m, 3) of points.

    A vertex on a crease has a point, and so a normal, on each side of it.

    vertices   (k, 3) m
    triangles  (m, 3) vertices of each
    """
    faces = np.arange(triangles.size).reshape(-1, 3)
    edges = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2)
    corners = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)
    order = np.lexsort(np.sort(edges, axis=1).T)
    one, other = order[:-1], order[1:]
    normal = unit(_area_normals(vertices[triangles]))
    smooth = (edges[one] == edges[other][:, ::-1]).all(axis=1)
    smooth &= (normal[one // 3] * normal[other // 3]).sum(axis=1) > np.cos(np.radians(CREASE))
    one, other = one[smooth], other[smooth]
    # the two triangles of an edge have it in opposite directions
    pairs = np.concatenate([corners[one], corners[other][:, ::-1]], axis=1)
    first, second = pairs[:, :2].ravel(), pairs[:, 2:].ravel()
    graph = coo_array((np.ones(first.size), (first, second)), shape=2 * (triangles.size,))
    count, point = connected_components(graph, directed=False)
    vertex = np.empty(count, np.int64)
    vertex[point] = triangles.ravel()
    return vertex, point.reshape(-1, 3).astype(np.int64)


def normals(points: Array, triangles: Integers) -> Array:
    """(n, 3) area-weighted mean normal of the triangles (m, 3) around each point."""
    total = np.zeros((len(points), 3))
    np.add.at(total, triangles, _area_normals(points[triangles])[:, None])
    return unit(total)


def _area_normals(corners: Array) -> Array:
    """(m, 3) normals of triangles with corners (m, 3, 3); their length is twice the area."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def exit_distance(start: Array, along: Array, corners: Array) -> float:
    """Distance along a unit vector `along` (3,) from `start` (3,) to the exit of a closed skin, m.

    Its triangles have corners (m, 3, 3) m. The distance is 0 from a start outside (Moeller and
    Trumbore 1997).
    """
    known = corners[np.isfinite(corners).all(axis=(1, 2))]
    slope = _area_normals(known) @ along
    crossed, slope = known[slope != 0.0], slope[slope != 0.0]
    first = crossed[:, 0] - start
    one, other = crossed[:, 1] - crossed[:, 0], crossed[:, 2] - crossed[:, 0]
    moment = np.cross(first, along)
    u, v = (moment * other).sum(axis=1) / slope, -(moment * one).sum(axis=1) / slope
    distance = (first * _area_normals(crossed)).sum(axis=1) / slope
    hit = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (distance > 0.0)
    if not hit.any():
        return 0.0
    nearest = np.flatnonzero(hit)[np.argmin(distance[hit])]
    return float(distance[nearest]) if slope[nearest] > 0.0 else 0.0


class Outside:
    """The bodies as convex parts bounded by planes, and the skins around them."""

    def __init__(self, geoms: Sequence[Geom], skins: Sequence[Skin] = ()) -> None:
        self._skins = skins
        self._planes = [_planes(mesh_of(geom)) for geom in geoms]
        self._parts: dict[int, list[int]] = {}
        for n, geom in enumerate(geoms):
            self._parts.setdefault(geom.body, []).append(n)

    def around(self, state: State) -> list[Array]:
        """(m, 3, 3) m, corners of the triangles of each skin in a state."""
        return [skin.vertices(state)[skin.triangles] for skin in self._skins]

    def reach(
        self, body: int, start: Array, vector: Array, state: State, around: Sequence[Array]
    ) -> float:
        """Distance, m, along `vector` (3,) from `start` (3,) to the exit of a body or of a skin.

        Of several the farthest counts; it is 0 from a start outside. `around` is that of the state.
        """
        along = vector / np.linalg.norm(vector)
        farthest = max((exit_distance(start, along, corners) for corners in around), default=0.0)
        for part in self._parts.get(body, ()):
            rotation, position = state["geom_rotation"][part], state["geom_position"][part]
            normals, heights = self._planes[part]
            depth = heights - normals @ ((start - position) @ rotation)
            slope = normals @ (along @ rotation)
            if (depth > 0.0).all():
                farthest = max(farthest, float((depth[slope > 0.0] / slope[slope > 0.0]).min()))
        return farthest


def force_arrows(
    forces: Forces, outside: Outside, state: State, pixel: float
) -> tuple[Array, Array]:
    """Tails, on the surfaces of the bodies, and vectors (n, 3) of the arrows of forces, m.

    pixel  size of a pixel, m
    """
    arrows = forces.arrows(state, pixel)
    around = outside.around(state) if arrows else []
    tails = [
        tail + outside.reach(body, tail, vector, state, around) * vector / np.linalg.norm(vector)
        for body, tail, vector in arrows
    ]
    vectors = [vector for *_, vector in arrows]
    return np.reshape(tails, (-1, 3)), np.reshape(vectors, (-1, 3))


def _planes(mesh: pv.PolyData) -> tuple[Array, Array]:
    """Outward normals (m, 3) of a mesh's faces, and their distances (m,) from the origin, m."""
    normals = np.asarray(mesh.face_normals, float)
    centres = np.asarray(mesh.cell_centers().points, float)
    return normals, np.einsum("ij,ij->i", normals, centres)
