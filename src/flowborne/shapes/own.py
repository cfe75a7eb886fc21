"""Geometries of one's own: a signed distance, and how far it reaches."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from flowborne.errors import PartError
from flowborne.extras import optional
from flowborne.kernels.node_distance import BAND, allow_for_curvature
from flowborne.registry import Registry
from flowborne.shapes.mesh import ShapeMesh
from flowborne.shapes.primitives import PRIMITIVES
from flowborne.shapes.shape import Array, Integers, Mesh, Samples, Shape, lattice, lattice_points

ACROSS = 48
"""Samples along the longest side of a geometry from which its triangles are made."""

FINER = 2.0
"""Samples of a distance that the fluid looks up, for each cell of its grid along an axis."""


class OwnGeometry(Protocol):
    """A closed solid about the origin of a frame of its own; lengths in m."""

    def distance(self, points: Array) -> Array:
        """(n,) signed distances of points (n, 3), negative inside, m."""
        ...

    def half_extents(self) -> Array:
        """(3,) half extents of a box about the origin around it, m."""
        ...


SHAPES: Registry[OwnGeometry] = Registry(
    "shape",
    ("distance", "half_extents"),
    taken=(*PRIMITIVES, ShapeMesh.kind),
    keys=("body", "position", "euler", "axis", "density"),
)
"""Geometries of one's own, by kind."""


@dataclass(frozen=True)
class PlacedShape:
    """A geometry of one's own as part of a body.

    geometry  an object of the registered class
    body      name
    position  (3,) of its origin in the body's frame, m
    rotation  (3, 3) its frame to the body's
    density   kg/m^3; the model's own for geoms unless given
    """

    geometry: OwnGeometry
    body: str
    position: Array = field(default_factory=lambda: np.zeros(3))
    rotation: Array = field(default_factory=lambda: np.eye(3))
    density: float | None = None


class ShapeOwn(ShapeMesh):
    """A geometry of one's own in the frame of the triangles that stand for it in the model.

    The fluid takes the geometry's own distance, and all else the triangles.

    centre, rotation  (3,) m, (3, 3): the triangles' frame to the geometry's
    vertices, faces   of the triangles, in their frame
    offset            how much thicker the fluid sees it all around, m
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
        places = self._centre + points @ self._rotation.T
        return own_distance(self.geometry, places) - self.offset

    def samples(self, spacing: float) -> Samples:
        pitch = spacing / FINER
        corner, counts = lattice(self.reach, pitch, BAND * spacing)
        found = self.distance(lattice_points(corner, pitch, counts)).reshape(counts)
        return Samples(corner, pitch, allow_for_curvature(found, pitch))

    def skin(self) -> Mesh | None:
        return None

    def thickened(self, half: float) -> Shape:
        """Thicker all around by what its thinnest part lacks."""
        offset = half - 0.5 * self.thickness
        if offset <= 0.0:
            return self
        frame = self._centre, self._rotation
        return ShapeOwn(self.geometry, *frame, self.vertices, self.faces, self.offset + offset)

    def tips(self, width: float) -> float:
        """A ball fits into it where a smaller one, by its offset, fits within its triangles."""
        return super().tips(width - 2.0 * self.offset)


def named(geometry: OwnGeometry) -> str:
    """The geometry, for messages."""
    return f"shape '{getattr(geometry, 'kind', type(geometry).__name__)}'"


def own_distance(geometry: OwnGeometry, points: Array) -> Array:
    """(n,) what the geometry says of points (n, 3), m. Raises PartError when it is no distance."""
    what = named(geometry)
    with PartError.guarding(what):
        distance = np.asarray(geometry.distance(points), dtype=np.float64)
    if distance.shape != (len(points),) or not np.isfinite(distance).all():
        raise PartError(
            f"{what} gave an array of shape {distance.shape}, or numbers that are not finite, for "
            f"{len(points)} points: return a finite distance in m for each"
        )
    return distance


def triangulated(geometry: OwnGeometry) -> Mesh:
    """Closed outward surface of a geometry of one's own, in its frame; it has its volume.

    What is thinner than a 48th of its longest side may be lost.
    raises  PartError when it is empty, or reaches beyond its half extents
    """
    pv = optional("pyvista", "PyVista", "flesh", "surfaces of shapes of one's own")

    what = named(geometry)
    with PartError.guarding(what):
        half = np.asarray(geometry.half_extents(), dtype=np.float64)
    if half.shape != (3,) or not (np.isfinite(half).all() and half.min() > 0.0):
        raise PartError(f"{what} has the half extents {half}: give three positive ones in m")
    pitch = 2.0 * half.max() / ACROSS
    corner, counts = lattice(half, pitch, pitch)
    places = lattice_points(corner, pitch, counts)
    distance = own_distance(geometry, places)
    beyond = (np.abs(places) > half * (1.0 + 1e-9)).any(axis=1)
    if distance.min() >= 0.0:
        raise PartError(f"{what} holds none of its box: its distance is negative nowhere in it")
    if distance[beyond].min() < 0.0:
        raise PartError(f"{what} reaches beyond its half extents {half} m: make them larger")
    facets = allow_for_curvature(distance.reshape(counts), pitch)
    box = pv.ImageData(dimensions=counts, spacing=(pitch,) * 3, origin=corner)
    box.point_data["distance"] = facets.ravel(order="F")
    surface = box.contour([0.0], scalars="distance", method="flying_edges")
    inward = surface.regular_faces.astype(np.int64)
    return np.asarray(surface.points, dtype=np.float64), inward[:, ::-1]
