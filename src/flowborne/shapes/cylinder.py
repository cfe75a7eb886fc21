"""Cylinder with flat ends."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.distance import CYLINDER
from flowborne.shapes.lines import in_cylinder
from flowborne.shapes.round import cylinder_profile, revolved, section_of_rod, swept_triangles
from flowborne.shapes.section import Section
from flowborne.shapes.shape import AROUND, ENDLESS, FINENESS, Array, Mesh, Primitive, Shape


class ShapeCylinder(Primitive):
    """Cylinder of radius size[0] about z and half length size[1]."""

    kind, code = "cylinder", CYLINDER

    @property
    def volume(self) -> float:
        a, b = (float(s) for s in self.size[:2])
        return 2.0 * np.pi * a**2 * b

    @property
    def reach(self) -> Array:
        radius, half_length = self.size[:2]
        return np.array([radius, radius, half_length if half_length < ENDLESS else 0.0])

    @property
    def thickness(self) -> float:
        return float(2.0 * self.size[:2].min())

    def section(self, rotation: Array, height: float) -> Section:
        return section_of_rod("rectangle", self.size, rotation[2], height)

    def interval(self, o: Array, d: Array) -> tuple[Array, Array]:
        return in_cylinder(o, d, self.size)

    def patches(self) -> tuple[Array, Array]:
        radius, half_length = (float(s) for s in self.size[:2])
        longest = 2.0 * max(radius, half_length) / FINENESS
        return revolved(cylinder_profile(radius, half_length, longest), np.ones(3))

    def triangles(self) -> Mesh:
        return swept_triangles(cylinder_profile(self.size[0], self.size[1], np.inf), np.ones(3))

    def landmarks(self) -> Array:
        across = np.linalg.norm(AROUND[:, :2], axis=1, keepdims=True)
        ring = AROUND[:, :2] / np.maximum(across, 1.0)
        return np.concatenate([self.size[0] * ring, self.size[1] * AROUND[:, 2:]], axis=1)

    def endless(self, rotation: Array, height: float) -> Shape:
        if int(np.argmax(np.abs(rotation[2]))) != 2:
            return self
        return ShapeCylinder(np.array([self.size[0], ENDLESS, self.size[2]]))
