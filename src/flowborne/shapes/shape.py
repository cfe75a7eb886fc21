"""The contract of a geometry."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np

from flowborne.kernels.arrays import Array, Integers, Mesh
from flowborne.kernels.distance import Samples, distances
from flowborne.shapes.section import Section
from flowborne.shapes.thickness import thin_parts

ENDLESS = 1e30
"""Half extent of a shape along an axis on which it has no ends, m."""

FINENESS = 8
"""A shape's longest side is divided into this many patches at least."""

AROUND = np.array([d for d in np.ndindex(3, 3, 3) if d != (1, 1, 1)], np.float64) - 1.0
"""The 26 directions to the neighbours of a cell."""

DIRECTIONS = AROUND / np.linalg.norm(AROUND, axis=1, keepdims=True)
"""The same as unit vectors."""


class Shape(ABC):
    """A solid in its own frame, around the origin; lengths in m. Immutable.

    kind  name in MJCF
    code  number of the kind for `kernels.distance.signed_distance`
    size  (3,) MuJoCo's half sizes, m
    """

    kind: ClassVar[str]
    code: ClassVar[int]
    size: Array

    @property
    @abstractmethod
    def volume(self) -> float:
        """Volume, m^3."""

    @property
    @abstractmethod
    def centroid(self) -> Array:
        """(3,) centroid, m."""

    @property
    @abstractmethod
    def reach(self) -> Array:
        """(3,) half extents of a box around it, about the origin, m; 0 where it is endless."""

    @property
    @abstractmethod
    def thickness(self) -> float:
        """Thickness of its thinnest part, m."""

    @abstractmethod
    def distance(self, points: Array) -> Array:
        """(n,) signed distances of points (n, 3), negative inside, m."""

    def samples(self, spacing: float) -> Samples | None:
        """Distances for interpolation on a grid of `spacing` m; None for kinds with a formula."""
        return None

    def skin(self) -> Mesh | None:
        """Triangles for exact distances near the surface; None for kinds without triangles."""
        return None

    @abstractmethod
    def section(self, rotation: Array, height: float) -> Section:
        """Cross-section at z = 0 when the origin is at z = `height` m.

        rotation  (3, 3) its frame to the world's
        raises    ValueError when no local axis is along z, or when it misses the plane z = 0
        """

    @abstractmethod
    def crossings(self, origins: Array, direction: Array) -> tuple[Integers, Array, Array]:
        """Where lines from origins (n, 3) along direction (3,) enter (+1) and leave (-1) it.

        returns  (k,) numbers of the lines, (k,) distances from the origins in units of the
                 direction, (k,) signs
        """

    @abstractmethod
    def patches(self) -> tuple[Array, Array]:
        """Flat patches of the surface: centres (n, 3) in m and outward area vectors (n, 3), m^2.

        None is longer than an eighth of the shape.
        """

    @abstractmethod
    def triangles(self) -> Mesh:
        """The closed surface for pictures; round shapes have 32 sides."""

    @abstractmethod
    def landmarks(self) -> Array:
        """(k, 3) points all over the surface, m."""

    @abstractmethod
    def outermost(self) -> Array:
        """(k, 3) outermost points of the surface, a few in every direction, m."""

    @abstractmethod
    def thickened(self, half: float) -> Shape:
        """The shape made at least 2 `half` m thick everywhere, without becoming longer or wider."""

    def tips(self, width: float) -> float:
        """Length of its tips along the surface, where no ball of diameter `width` m fits in, m."""
        return thin_parts(*self.triangles(), width)

    @abstractmethod
    def endless(self, rotation: Array, height: float) -> Shape:
        """The shape extended along the world's z, for a slab; arguments as in `section`."""


class Primitive(Shape):
    """A convex shape around its origin, defined by its half sizes.

    size  (3,) MuJoCo's half sizes, m; entries that the kind does not need have no meaning
    """

    def __init__(self, size: Array) -> None:
        self.size = np.array(size, np.float64)

    @property
    def centroid(self) -> Array:
        return np.zeros(3)

    def distance(self, points: Array) -> Array:
        return distances(self.code, self.size, points)

    def crossings(self, origins: Array, direction: Array) -> tuple[Integers, Array, Array]:
        enter, leave = self.interval(origins, direction)
        hit = np.flatnonzero(leave > enter)
        one = np.ones(hit.size)
        distances, signs = (enter[hit], leave[hit]), (one, -one)
        return np.tile(hit, 2), np.concatenate(distances), np.concatenate(signs)

    def outermost(self) -> Array:
        return self.landmarks()

    @abstractmethod
    def interval(self, o: Array, d: Array) -> tuple[Array, Array]:
        """Part (enter, leave) of each line o + t d inside it; leave <= enter where it misses."""

    def thickened(self, half: float) -> Shape:
        return type(self)(np.maximum(self.size, half))

    def tips(self, width: float) -> float:
        """0: it is round, or has right angles."""
        return 0.0

    def endless(self, rotation: Array, height: float) -> Shape:
        return self


def lattice(reach: Array, pitch: float, margin: float) -> tuple[Array, Integers]:
    """First point (3,) and counts (3,) of a lattice `margin` m beyond the half extents `reach`."""
    corner = -np.ceil((reach + margin) / pitch) * pitch
    return corner, np.rint(-2.0 * corner / pitch).astype(np.int64) + 1


def lattice_points(corner: Array, pitch: float, counts: Integers) -> Array:
    """(n, 3) points of a lattice, z fastest, m."""
    return corner + pitch * np.stack([i.ravel() for i in np.indices(tuple(counts))], axis=1)


def unit(vectors: Array) -> Array:
    """Vectors (..., 3) scaled to length 1; zero vectors stay 0."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.maximum(length, np.finfo(float).tiny))
