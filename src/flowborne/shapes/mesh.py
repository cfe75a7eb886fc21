"""A solid bounded by the user's triangles."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from flowborne.kernels.arrays import Array, Integers, Mesh, Nodes
from flowborne.kernels.distance import MESH, Samples
from flowborne.kernels.node_distance import BAND
from flowborne.kernels.skin import sample_skin
from flowborne.kernels.thickness import way_inward
from flowborne.kernels.triangles import Sheets, crossings, distances_to_mesh, lower_to_sheets
from flowborne.shapes.section import Section, cross
from flowborne.shapes.shape import DIRECTIONS, FINENESS, Shape, lattice, unit
from flowborne.shapes.thickness import connected, outward, split_quads, thin_parts, thinnest

UNDETERMINED_BELOW = 0.02
"""Largest mean square of the normals along a direction for which they do not determine the motion
of a vertex along it: all normals are within about 8 degrees of the plane across."""

SMOOTH_COSINE = np.cos(np.pi / 4.0)
"""Cosine of the largest angle between triangles of one smooth sheet."""

SHEET_SAMPLES_PER_CELL = 2.0
"""Samples of the distance to sheets per cell of the grid along an axis."""

SHEET_BAND = 2.5
"""Width of the band in which this distance is sampled, in cells."""


class ShapeMesh(Shape):
    """The inside of a closed surface.

    vertices  (k, 3) m
    faces     (m, 3) outward
    """

    kind, code = "mesh", MESH

    def __init__(self, vertices: Array, faces: Integers) -> None:
        self.vertices, self.faces = welded(vertices, faces)
        self.size = 0.5 * np.ptp(vertices, axis=0)
        self._thickened: dict[float, Shape] = {}
        self._tips: dict[float, float] = {}

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
        return thinnest(self.vertices, self.faces, False, self._way)

    @cached_property
    def _way(self) -> Array:
        """(m,) distance from the middle of each triangle straight inward to another one, m."""
        return way_inward(self.vertices, self.faces)

    def distance(self, points: Array) -> Array:
        return distances_to_mesh(points, self.vertices, self.faces)

    def samples(self, spacing: float) -> Samples:
        """Spaced as the nodes of the grid; near the surface they are not used."""
        corner, counts = lattice(self.reach, spacing, BAND * spacing)
        box = np.stack([np.zeros_like(counts), counts], axis=1)
        nodes = Nodes(corner, spacing, flat=False)
        found = sample_skin(self.vertices, self.faces, box, nodes, BAND)
        return Samples(corner, spacing, found)

    def skin(self) -> Mesh | None:
        return self.vertices, self.faces

    def section(self, rotation: Array, height: float) -> Section:
        """One oriented segment for each cut triangle.

        A vertex in the plane counts as just above it, so that the outline is closed.
        """
        x, y, z = rotation
        axes, foot = np.stack([x, y]), -height * z
        level = self.vertices @ z + height
        edges = self.faces[:, [[0, 1], [1, 2], [2, 0]]]
        above = level[edges] >= 0.0
        rising = edges[~above[..., 0] & above[..., 1]]
        falling = edges[above[..., 0] & ~above[..., 1]]
        if len(rising) == 0:
            raise ValueError("misses the plane z = 0")
        ends = np.stack([rising, falling], axis=1)
        low, high = ends.min(axis=2), ends.max(axis=2)  # the same numbers from both triangles
        share = (level[low] / (level[low] - level[high]))[..., None]
        plane = (self.vertices - foot) @ axes.T
        segments = plane[low] + share * (plane[high] - plane[low])
        if cross(segments[:, 0], segments[:, 1]).sum() < 0.0:
            segments = segments[:, ::-1]
        return Section("segments", (0.0, 0.0), foot, axes, np.ascontiguousarray(segments))

    def crossings(self, origins: Array, direction: Array) -> tuple[Integers, Array, Array]:
        return crossings(self.vertices, self.faces, origins, direction)

    def patches(self) -> tuple[Array, Array]:
        import trimesh  # takes 0.1 s, and only meshes need it

        longest = float(np.ptp(self.vertices, axis=0).max()) / FINENESS
        vertices, faces = trimesh.remesh.subdivide_to_size(
            self.vertices, self.faces, longest, max_iter=20
        )
        corners = vertices[faces]
        return corners.mean(axis=1), 0.5 * outward(corners)

    def triangles(self) -> Mesh:
        return self.vertices, self.faces

    def landmarks(self) -> Array:
        return self.vertices

    def outermost(self) -> Array:
        farthest = np.unique(np.argmax(self.vertices @ DIRECTIONS.T, axis=0))
        return np.asarray(self.vertices[farthest])

    def thickened(self, half: float) -> Shape:
        """The mesh with sheets in its thin parts."""
        if half not in self._thickened:
            thin = self._way < 2.0 * half
            self._thickened[half] = ShapeThickened(self, half) if thin.any() else self
        return self._thickened[half]

    def tips(self, width: float) -> float:
        if width not in self._tips:
            self._tips[width] = super().tips(width)
        return self._tips[width]

    def endless(self, rotation: Array, height: float) -> Shape:
        """The sides of a prism without its ends."""
        section = self.section(rotation, height)
        points, number = np.unique(section.segments.reshape(-1, 2), axis=0, return_inverse=True)
        start, end = number.reshape(-1, 2).T
        ring = section.centre + points @ section.axes
        rise = np.ptp(points, axis=0).max() * rotation[2]
        sides = split_quads(start, end, end + len(points), start + len(points))
        return ShapePrism(np.concatenate([ring - rise, ring + rise]), sides)


class ShapePrism(ShapeMesh):
    """The sides of a prism."""

    def thickened(self, half: float) -> Shape:
        """The prism with thin sides moved outward, by their corners along the normals."""
        offset = np.maximum(half - 0.5 * self._way, 0.0)
        if not offset.any():
            return self
        return ShapePrism(self.vertices + offsets(self.vertices, self.faces, offset), self.faces)


class ShapeThickened(ShapeMesh):
    """A mesh with sheets 2 `half` m thick along the middle of its thin parts.

    The fluid uses the distance to mesh and sheets; all other properties are those of the mesh. At a
    rim, a sheet ends where its thin part ends: it is as long and wide as the mesh.

    mesh  the original mesh
    half  m
    """

    def __init__(self, mesh: ShapeMesh, half: float) -> None:
        super().__init__(mesh.vertices, mesh.faces)
        self.half, self._way = half, mesh._way
        self._thin = self._way < 2.0 * half

    @property
    def reach(self) -> Array:
        return super().reach + self.half

    @property
    def thickness(self) -> float:
        way = np.maximum(self._way, 2.0 * self.half)
        return thinnest(self.vertices, self.faces, False, way)

    def samples(self, spacing: float) -> Samples:
        """Distances to the sheets alone."""
        pitch = spacing / SHEET_SAMPLES_PER_CELL
        corner, counts = lattice(self.reach, pitch, BAND * spacing)
        values = np.full(counts, BAND * spacing)
        lower_to_sheets(values, corner, pitch, self._sheets(), SHEET_BAND * spacing)
        return Samples(corner, pitch, values)

    def tips(self, width: float) -> float:
        """As for the mesh, where a ball fits into the sheets."""
        return thin_parts(self.vertices, self.faces, width, self._thin)

    def _sheets(self) -> Sheets:
        """About the triangles in the middle of thin parts."""
        corners = self.vertices[self.faces[self._thin]]
        normals = unit(outward(self.vertices[self.faces]))
        normal = normals[self._thin]
        middle = corners - 0.5 * self._way[self._thin, None, None] * normal[:, None]
        edge = np.roll(corners, -1, axis=1) - corners
        across = unit(np.cross(edge, normal[:, None]))
        adjacent = neighbours(self.faces)[self._thin]
        smooth = np.einsum("ted,td->te", normals[adjacent], normal) > SMOOTH_COSINE
        ends = np.maximum(self.half - 0.5 * self._way[adjacent], 0.0)
        limit = np.where(smooth & self._thin[adjacent], np.inf, ends)
        number = self.faces[self._thin]
        limited = np.flatnonzero(np.isfinite(limit))
        ends_at = np.concatenate([number.ravel(), np.roll(number, -1, axis=1).ravel()])
        ends_at = ends_at.reshape(2, -1)[:, limited].ravel()
        order = np.argsort(ends_at, kind="stable")
        start = np.searchsorted(ends_at[order], np.arange(len(self.vertices) + 1))
        rims = np.tile(limited, 2)[order]
        return Sheets(middle, normal, across, limit, number, start, rims, self.half)


def neighbours(faces: Integers) -> Integers:
    """(m, 3) neighbour across each edge of triangles (m, 3); the triangle itself without one."""
    edges = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2), axis=2).reshape(-1, 2)
    order = np.lexsort(edges.T)
    same = np.flatnonzero((edges[order[1:]] == edges[order[:-1]]).all(axis=1))
    found = np.repeat(np.arange(len(faces)), 3)
    one, other = order[same], order[same + 1]
    found[one], found[other] = other // 3, one // 3
    return found.reshape(-1, 3)


def smooth_sheets(vertices: Array, faces: Integers) -> Integers:
    """(m,) number of the smooth sheet of each triangle (m, 3) of vertices (k, 3): those whose
    normals differ by less than SMOOTH_COSINE says belong together across their common edge."""
    normals, adjacent = unit(outward(vertices[faces])), neighbours(faces)
    smooth = np.einsum("tei,ti->te", normals[adjacent], normals) > SMOOTH_COSINE
    one, edge = np.nonzero(smooth)
    return connected(len(faces), one, adjacent[one, edge]).astype(np.int64)


def welded(vertices: Array, faces: Integers) -> Mesh:
    """The surface without duplicate vertices and without triangles that this collapses."""
    distinct, number = np.unique(vertices, axis=0, return_inverse=True)
    if len(distinct) == len(vertices):
        return vertices, faces
    joined = number.ravel()[faces]
    whole = (joined != np.roll(joined, 1, axis=1)).all(axis=1)
    return distinct, joined[whole]


def offsets(vertices: Array, faces: Integers, distance: Array) -> Array:
    """(k, 3) how vertices move so that each triangle moves outward by its `distance` (m,), m.

    The least-squares solution of n . d = distance over the triangles of a vertex, weighted by
    their angles there; n is their normal. Directions that they hardly determine are dropped, and no
    vertex moves farther than the corner of a cube.
    """
    corners = vertices[faces]
    normal = outward(corners)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    matrix, rhs = np.zeros((len(vertices), 3, 3)), np.zeros((len(vertices), 3))
    weight, most = np.zeros(len(vertices)), np.zeros(len(vertices))
    for k in range(3):
        a, b = (corners[:, (k + n) % 3] - corners[:, k] for n in (1, 2))
        angle = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), (a * b).sum(axis=1))
        outer = normal[:, :, None] * normal[:, None, :]
        np.add.at(matrix, faces[:, k], angle[:, None, None] * outer)
        np.add.at(rhs, faces[:, k], (angle * distance)[:, None] * normal)
        np.add.at(weight, faces[:, k], angle)
        np.maximum.at(most, faces[:, k], distance)
    value, vector = np.linalg.eigh(matrix / weight[:, None, None])
    known = value > UNDETERMINED_BELOW
    part = np.einsum("vij,vi->vj", vector, rhs / weight[:, None])
    part = np.where(known, part / np.where(known, value, 1.0), 0.0)
    moved = np.einsum("vij,vj->vi", vector, part)
    length = np.linalg.norm(moved, axis=1)
    return moved * np.minimum(1.0, np.sqrt(3.0) * most / np.maximum(length, 1e-300))[:, None]
