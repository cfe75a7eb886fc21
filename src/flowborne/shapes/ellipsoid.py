"""Ellipsoid."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.distance import ELLIPSOID
from flowborne.shapes.lines import in_unit_ball
from flowborne.shapes.round import ARC, capsule_profile, revolved, swept_triangles
from flowborne.shapes.section import Section, chord, upright_axis
from flowborne.shapes.shape import DIRECTIONS, ENDLESS, Array, Mesh, Primitive, Shape
from flowborne.shapes.thickness import thin_parts


class ShapeEllipsoid(Primitive):
    """Ellipsoid of semi-axes size."""

    kind, code = "ellipsoid", ELLIPSOID

    @property
    def volume(self) -> float:
        a, b, c = (float(s) for s in self.size)
        return 4.0 / 3.0 * np.pi * a * b * c

    @property
    def reach(self) -> Array:
        return np.where(self.size < ENDLESS, self.size, 0.0)

    @property
    def thickness(self) -> float:
        return float(2.0 * self.size.min())

    def section(self, rotation: Array, height: float) -> Section:
        z = rotation[2]
        k = upright_axis(z)
        first, second = (k + 1) % 3, (k + 2) % 3
        axes = np.stack([np.eye(3)[first], np.sign(z[k]) * np.eye(3)[second]])
        half = np.array([self.size[first], self.size[second]])
        half = half * chord(self.size[k], height) / self.size[k]
        extents = float(half[0]), float(half[1])
        return Section("ellipse", extents, -height * z, axes, np.zeros((0, 2, 2)))

    def interval(self, o: Array, d: Array) -> tuple[Array, Array]:
        return in_unit_ball(o / self.size, d / self.size)

    def patches(self) -> tuple[Array, Array]:
        return revolved(capsule_profile(1.0, 0.0, 1.0, ARC), self.size)

    def triangles(self) -> Mesh:
        return swept_triangles(capsule_profile(1.0, 0.0, np.inf, 2 * ARC), self.size)

    def landmarks(self) -> Array:
        return np.asarray(DIRECTIONS * self.size)

    def tips(self, width: float) -> float:
        """Its rim or its ends may be sharp."""
        return thin_parts(*self.triangles(), width)

    def endless(self, rotation: Array, height: float) -> Shape:
        size = self.size.copy()
        size[int(np.argmax(np.abs(rotation[2])))] = ENDLESS
        return ShapeEllipsoid(size)
