"""Where a line from within a body leaves it, so that the arrow of a force starts at the skin."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from flowborne.view.forces import Forces
from flowborne.view.run import Geom, Skin, State
from flowborne.view.space.skin import way_out

Array = NDArray[np.float64]


class Outside:
    """The bodies as convex parts bounded by planes, and the skins around them.

    meshes  of the geometries, in their own frames
    """

    def __init__(
        self, geoms: Sequence[Geom], meshes: Sequence[pv.PolyData], skins: Sequence[Skin] = ()
    ) -> None:
        self._skins = skins
        self._planes = [_planes(mesh) for mesh in meshes]
        self._parts: dict[int, list[int]] = {}
        for n, geom in enumerate(geoms):
            self._parts.setdefault(geom.body, []).append(n)

    def around(self, state: State) -> list[Array]:
        """(m, 3, 3) m, the corners of each skin's triangles in a state."""
        return [skin.vertices(state)[skin.triangles] for skin in self._skins]

    def reach(
        self, body: int, place: Array, vector: Array, state: State, around: Sequence[Array]
    ) -> float:
        """m along `vector` (3,) from `place` (3,) to the surface of a body or of the skin around
        the place; 0 from outside both. `around` is that of the state."""
        along = vector / np.linalg.norm(vector)
        farthest = 0.0
        for corners in around:
            farthest = max(farthest, way_out(place, along, corners))
        for part in self._parts.get(body, ()):
            turn, centre = state["geom_rotation"][part], state["geom_position"][part]
            normals, heights = self._planes[part]
            room = heights - normals @ ((place - centre) @ turn)
            slope = normals @ (along @ turn)
            if (room > 0.0).all():
                farthest = max(farthest, float((room[slope > 0.0] / slope[slope > 0.0]).min()))
        return farthest


def pushes(forces: Forces, outside: Outside, state: State, pixel: float) -> tuple[Array, Array]:
    """Tails, on the bodies' surfaces, and vectors (n, 3) of the arrows of forces, m.

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
    """Outward normals (m, 3) of a mesh's faces, and their heights (m,) over the origin, m."""
    normals = np.asarray(mesh.face_normals, float)
    middles = np.asarray(mesh.cell_centers().points, float)
    return normals, np.einsum("ij,ij->i", normals, middles)
