"""Cylinder with round ends."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.distance import CAPSULE
from flowborne.shapes.lines import in_cylinder, in_unit_ball
from flowborne.shapes.round import ARC, capsule_profile, revolved, section_of_rod, swept_triangles
from flowborne.shapes.section import Section
from flowborne.shapes.shape import AROUND, DIRECTIONS, FINENESS, Array, Mesh, Primitive, Shape


class ShapeCapsule(Primitive):
    """Capsule of radius size[0] about z; half length size[1] of the straight part."""

    kind, code = "capsule", CAPSULE

    @property
    def volume(self) -> float:
        a, b = (float(s) for s in self.size[:2])
        return 2.0 * np.pi * a**2 * b + 4.0 / 3.0 * np.pi * a**3

    @property
    def reach(self) -> Array:
        radius, half_length = self.size[:2]
        return np.array([radius, radius, radius + half_length])

    @property
    def thickness(self) -> float:
        return float(2.0 * self.size[0])

    def section(self, rotation: Array, height: float) -> Section:
        return section_of_rod("stadium", self.size, rotation[2], height)

    def interval(self, o: Array, d: Array) -> tuple[Array, Array]:
        enter, leave = in_cylinder(o, d, self.size)
        gone = leave <= enter
        enter, leave = np.where(gone, np.inf, enter), np.where(gone, -np.inf, leave)
        for end in (-self.size[1], self.size[1]):
            low, high = in_unit_ball((o - [0.0, 0.0, end]) / self.size[0], d / self.size[0])
            enter, leave = np.minimum(enter, low), np.maximum(leave, high)
        return enter, leave

    def patches(self) -> tuple[Array, Array]:
        radius, half_length = (float(s) for s in self.size[:2])
        longest = 2.0 * (radius + half_length) / FINENESS
        return revolved(capsule_profile(radius, half_length, longest, ARC), np.ones(3))

    def triangles(self) -> Mesh:
        profile = capsule_profile(self.size[0], self.size[1], np.inf, 2 * ARC)
        return swept_triangles(profile, np.ones(3))

    def landmarks(self) -> Array:
        return np.asarray(self.size[0] * DIRECTIONS + np.sign(AROUND) * [0.0, 0.0, self.size[1]])

    def thickened(self, half: float) -> Shape:
        radius, half_length, unused = self.size
        return ShapeCapsule(np.array([max(radius, half), half_length, unused]))
