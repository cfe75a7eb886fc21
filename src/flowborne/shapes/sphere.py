"""Ball."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.distance import SPHERE
from flowborne.shapes.lines import in_unit_ball
from flowborne.shapes.round import ARC, capsule_profile, revolved, swept_triangles
from flowborne.shapes.section import Section, chord
from flowborne.shapes.shape import DIRECTIONS, FINENESS, Array, Mesh, Primitive


class ShapeSphere(Primitive):
    """Ball of radius size[0]."""

    kind, code = "sphere", SPHERE

    @property
    def volume(self) -> float:
        return float(4.0 / 3.0 * np.pi * self.size[0] ** 3)

    @property
    def reach(self) -> Array:
        return np.full(3, self.size[0])

    @property
    def thickness(self) -> float:
        return float(2.0 * self.size[0])

    def section(self, rotation: Array, height: float) -> Section:
        x, y, z = rotation
        radius = chord(self.size[0], height)
        none = np.zeros((0, 2, 2))
        return Section("ellipse", (radius, radius), -height * z, np.stack([x, y]), none)

    def interval(self, o: Array, d: Array) -> tuple[Array, Array]:
        return in_unit_ball(o / self.size[0], d / self.size[0])

    def patches(self) -> tuple[Array, Array]:
        radius = float(self.size[0])
        profile = capsule_profile(radius, 0.0, 2.0 * radius / FINENESS, ARC)
        return revolved(profile, np.ones(3))

    def triangles(self) -> Mesh:
        return swept_triangles(capsule_profile(self.size[0], 0.0, np.inf, 2 * ARC), np.ones(3))

    def landmarks(self) -> Array:
        return np.asarray(self.size[0] * DIRECTIONS)
