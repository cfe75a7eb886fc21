"""The user's own geometries: a signed distance and its half extents."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from flowborne.base.errors import PartError
from flowborne.base.extras import optional
from flowborne.base.registry import Registry
from flowborne.kernels.arrays import Array, Integers, Mesh
from flowborne.kernels.distance import Samples
from flowborne.kernels.node_distance import BAND, NEAR
from flowborne.shapes.mesh import ShapeMesh
from flowborne.shapes.primitives import PRIMITIVES
from flowborne.shapes.shape import Shape, lattice, lattice_points

SAMPLES_ACROSS = 48
"""Samples along the longest side of a geometry for its triangles."""

SAMPLES_PER_CELL = 2.0
"""Samples of a distance for the fluid, per cell of its grid along an axis."""

FACET = 1.0 / 12.0
"""Mean of what linear interpolation in tetrahedra adds to the distance to a curved surface, over
h^2 and the sum of its curvatures."""


class OwnGeometry(Protocol):
    """A closed solid around the origin of its own frame; lengths in m."""

    def distance(self, points: Array) -> Array:
        """(n,) signed distances of points (n, 3), negative inside, m."""
        ...

    def half_extents(self) -> Array:
        """(3,) half extents of a box around it, about the origin, m."""
        ...


SHAPES: Registry[OwnGeometry] = Registry(
    "shape",
    ("distance", "half_extents"),
    taken=(*PRIMITIVES, ShapeMesh.kind),
    keys=("body", "position", "euler", "axis", "density"),
)
"""The user's own geometries, by kind."""


@dataclass(frozen=True)
class PlacedShape:
    """A user's geometry as part of a body.

    geometry  an object of the registered class
    body      name
    position  (3,) of its origin in the body's frame, m
    rotation  (3, 3) its frame to the body's
    density   kg/m^3; None for that of the model's geoms
    """

    geometry: OwnGeometry
    body: str
    position: Array = field(default_factory=lambda: np.zeros(3))
    rotation: Array = field(default_factory=lambda: np.eye(3))
    density: float | None = None


class ShapeOwn(ShapeMesh):
    """A user's geometry in the frame of the triangles that represent it in the model.

    The fluid uses the distance of the geometry; everything else uses the triangles.

    centre, rotation  (3,) m, (3, 3): the triangles' frame to the geometry's
    vertices, faces   of the triangles, in their frame
    offset            distance by which the surface in the fluid is moved outward, m
    """

    def __init__(
        self,
        geometry: OwnGeometry,
        centre: Array,
        rotation: Array,
        vertices: Array,
        faces: Integers,
        offset: float = 0.0,
    ) -> None:
        super().__init__(vertices, faces)
        self.geometry, self.offset = geometry, offset
        self._centre, self._rotation = centre, rotation

    @property
    def reach(self) -> Array:
        return super().reach + self.offset

    @property
    def thickness(self) -> float:
        return super().thickness + 2.0 * self.offset

    def distance(self, points: Array) -> Array:
        local = self._centre + points @ self._rotation.T
        return own_distance(self.geometry, local) - self.offset

    def samples(self, spacing: float) -> Samples:
        pitch = spacing / SAMPLES_PER_CELL
        corner, counts = lattice(self.reach, pitch, BAND * spacing)
        found = self.distance(lattice_points(corner, pitch, counts)).reshape(counts)
        return Samples(corner, pitch, allow_for_curvature(found, pitch))

    def skin(self) -> Mesh | None:
        return None

    def thickened(self, half: float) -> Shape:
        """The geometry moved outward by half of what its thinnest part lacks."""
        offset = half - 0.5 * self.thickness
        if offset <= 0.0:
            return self
        frame = self._centre, self._rotation
        return ShapeOwn(self.geometry, *frame, self.vertices, self.faces, self.offset + offset)

    def tips(self, width: float) -> float:
        """As for the triangles, with a ball smaller by twice the offset."""
        return super().tips(width - 2.0 * self.offset)


def named(geometry: OwnGeometry) -> str:
    """The geometry, for messages."""
    return f"shape '{getattr(geometry, 'kind', type(geometry).__name__)}'"


def own_distance(geometry: OwnGeometry, points: Array) -> Array:
    """(n,) distances of points (n, 3) from the geometry, m. Raises PartError for bad results."""
    what = named(geometry)
    with PartError.guarding(what):
        distance = np.asarray(geometry.distance(points), dtype=np.float64)
    if distance.shape != (len(points),) or not np.isfinite(distance).all():
        raise PartError(
            f"{what} gave an array of shape {distance.shape}, or numbers that are not finite, for "
            f"{len(points)} points: return a finite distance in m for each"
        )
    return distance


def allow_for_curvature(distance: Array, pitch: float) -> Array:
    """The distance (nx, ny, nz) on a lattice with which facets leave a curved body its size.

    A ball of 8 pitches across would lack 3.1 % of its volume. Where the second difference has
    another sign beside, at edges and in the middle of thin plates, the distance is left as it is;
    else the least of the three counts.
    """
    total = np.zeros_like(distance)
    for axis in range(3):
        second = np.diff(np.moveaxis(distance, axis, 0), 2, axis=0)
        near = np.stack([second[:-2], second[1:-1], second[2:]])
        same = np.abs(np.sign(near).sum(axis=0)) == 3.0
        gentle = np.sign(near[0]) * np.abs(near).min(axis=0)
        np.moveaxis(total, axis, 0)[2:-2] += np.where(same, gentle, 0.0)
    return np.where(np.abs(distance) < NEAR * pitch, distance - FACET * total, distance)


def triangulated(geometry: OwnGeometry) -> Mesh:
    """Closed outward surface of a user's geometry, in its frame, with its volume.

    Parts thinner than a 48th of the longest side may be lost.
    raises  PartError when the geometry is empty, or extends beyond its half extents
    """
    pv = optional("pyvista", "PyVista", "flesh", "surfaces of shapes of one's own")

    what = named(geometry)
    with PartError.guarding(what):
        half = np.asarray(geometry.half_extents(), dtype=np.float64)
    if half.shape != (3,) or not (np.isfinite(half).all() and half.min() > 0.0):
        raise PartError(f"{what} has the half extents {half}: give three positive ones in m")
    pitch = 2.0 * half.max() / SAMPLES_ACROSS
    corner, counts = lattice(half, pitch, pitch)
    points = lattice_points(corner, pitch, counts)
    distance = own_distance(geometry, points)
    beyond = (np.abs(points) > half * (1.0 + 1e-9)).any(axis=1)
    if distance.min() >= 0.0:
        raise PartError(f"{what} holds none of its box: its distance is negative nowhere in it")
    if distance[beyond].min() < 0.0:
        raise PartError(f"{what} reaches beyond its half extents {half} m: make them larger")
    facets = allow_for_curvature(distance.reshape(counts), pitch)
    box = pv.ImageData(dimensions=counts, spacing=(pitch,) * 3, origin=corner)
    return level_surface(box, facets.ravel(order="F"), 0.0)


def level_surface(box: Any, distance: Array, level: float) -> Mesh:
    """Closed outward surface where the distance (n,) at the points of a lattice is `level`."""
    box.point_data["distance"] = distance
    surface = box.contour([level], scalars="distance", method="flying_edges")
    inward = surface.regular_faces.astype(np.int64)
    return np.asarray(surface.points, dtype=np.float64), inward[:, ::-1]
