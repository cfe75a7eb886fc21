"""A body of triangles, the user's own."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.distance import MESH
from flowborne.kernels.mesh_distance import distances_to_mesh
from flowborne.shapes.section import Section, cross
from flowborne.shapes.shape import FINENESS, Array, Integers, Mesh, Shape
from flowborne.shapes.thickness import thinnest


class ShapeMesh(Shape):
    """What a closed surface encloses.

    vertices  (k, 3) m
    faces     (m, 3) outward
    """

    kind, code = "mesh", MESH

    def __init__(self, vertices: Array, faces: Integers) -> None:
        self.vertices, self.faces = vertices, faces
        self.size = 0.5 * np.ptp(vertices, axis=0)

    @property
    def volume(self) -> float:
        return float(self._tetrahedra()[1].sum())

    @property
    def centroid(self) -> Array:
        corners, volumes = self._tetrahedra()
        moment = (volumes[:, None] * corners.sum(axis=1) / 4.0).sum(axis=0)
        return np.asarray(moment / volumes.sum())

    def _tetrahedra(self) -> tuple[Array, Array]:
        """Triangles (m, 3, 3) and signed volumes (m,) of the tetrahedra they span with the origin.

        By the divergence theorem the volumes sum to the shape's.
        """
        corners = self.vertices[self.faces]
        return corners, np.linalg.det(corners) / 6.0

    @property
    def reach(self) -> Array:
        low, high = self.vertices.min(axis=0), self.vertices.max(axis=0)
        return np.asarray(np.maximum(np.abs(low), np.abs(high)))

    @property
    def thickness(self) -> float:
        return thinnest(self.vertices, self.faces, False)

    def distance(self, points: Array) -> Array:
        return distances_to_mesh(points, self.vertices, self.faces)

    def section(self, rotation: Array, height: float) -> Section:
        """One oriented segment for each triangle that is cut.

        A vertex in the plane counts as just above it, so that the outline closes.
        """
        x, y, z = rotation
        axes, foot = np.stack([x, y]), -height * z
        level = self.vertices @ z + height
        above = level[self.faces] >= 0.0
        cut = np.flatnonzero(above.any(axis=1) & ~above.all(axis=1))
        if cut.size == 0:
            raise ValueError("misses the plane z = 0")
        plane = (self.vertices - foot) @ axes.T
        segments = np.empty((cut.size, 2, 2))
        for n, triangle in enumerate(self.faces[cut]):
            for i in range(3):
                a, b = triangle[i], triangle[(i + 1) % 3]
                up = level[b] >= 0.0
                if (level[a] >= 0.0) != up:
                    share = level[a] / (level[a] - level[b])
                    segments[n, 0 if up else 1] = plane[a] + share * (plane[b] - plane[a])
        if cross(segments[:, 0], segments[:, 1]).sum() < 0.0:
            segments = segments[:, ::-1]
        return Section("segments", (0.0, 0.0), foot, axes, np.ascontiguousarray(segments))

    def crossings(self, origins: Array, direction: Array) -> tuple[Integers, Array, Array]:
        """Triangle by triangle (Möller and Trumbore 1997)."""
        lines, places, signs = [], [], []
        for first, second, third in self.vertices[self.faces]:
            e1, e2 = second - first, third - first
            p = np.cross(direction, e2)
            determinant = float(e1 @ p)
            if abs(determinant) < 1e-300:
                continue
            s = origins - first
            u = s @ p / determinant
            q = np.cross(s, e1)
            v = q @ direction / determinant
            hit = np.flatnonzero((u >= 0.0) & (v >= 0.0) & (u + v < 1.0))
            lines.append(hit)
            places.append(q[hit] @ e2 / determinant)
            signs.append(np.full(hit.size, np.sign(determinant)))
        return np.concatenate(lines), np.concatenate(places), np.concatenate(signs)

    def patches(self) -> tuple[Array, Array]:
        import trimesh  # a tenth of a second that only meshes need

        longest = float(np.ptp(self.vertices, axis=0).max()) / FINENESS
        vertices, faces = trimesh.remesh.subdivide_to_size(
            self.vertices, self.faces, longest, max_iter=20
        )
        corners = vertices[faces]
        sides = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        return corners.mean(axis=1), 0.5 * np.cross(*sides)

    def triangles(self) -> Mesh:
        return self.vertices, self.faces

    def landmarks(self) -> Array:
        return self.vertices

    def thickened(self, half: float) -> Shape:
        return self

    def endless(self, rotation: Array, height: float) -> Shape:
        return self
