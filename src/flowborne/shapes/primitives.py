"""Spheres, capsules, cylinders, boxes and ellipsoids, and the shape of a geometry of MuJoCo."""

from __future__ import annotations

from abc import abstractmethod
from itertools import product
from typing import ClassVar

import numpy as np

from flowborne.kernels.arrays import Array, Mesh
from flowborne.kernels.distance import BOX, CAPSULE, CYLINDER, ELLIPSOID, SPHERE
from flowborne.shapes.mesh import ShapeMesh
from flowborne.shapes.round import (
    ARC,
    capsule_profile,
    cylinder_profile,
    parts,
    revolved,
    section_of_rod,
    swept_triangles,
)
from flowborne.shapes.section import Section, chord, upright_axis
from flowborne.shapes.shape import AROUND, DIRECTIONS, ENDLESS, FINENESS, Primitive, Shape
from flowborne.shapes.thickness import thin_parts

CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))

SIDES = np.array(
    [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
)
"""Corners of each side of a box, outward."""


def between(o: Array, d: Array, half: Array) -> tuple[Array, Array]:
    """Part of each line where |o + t d| <= half in every component."""
    enter, leave = np.full(len(o), -np.inf), np.full(len(o), np.inf)
    for k in range(o.shape[1]):
        if abs(d[k]) > 1e-12:
            ends = np.stack([-half[k] - o[:, k], half[k] - o[:, k]]) / d[k]
            enter = np.maximum(enter, ends.min(axis=0))
            leave = np.minimum(leave, ends.max(axis=0))
        else:
            enter = np.where(np.abs(o[:, k]) < half[k], enter, np.inf)
            leave = np.where(np.abs(o[:, k]) < half[k], leave, -np.inf)
    return enter, leave


def in_unit_ball(o: Array, d: Array) -> tuple[Array, Array]:
    """Part of each line where |o + t d| <= 1; the whole line or nothing for d = 0."""
    a, b, c = float(d @ d), o @ d, (o * o).sum(axis=1) - 1.0
    if a < 1e-24:
        return np.where(c < 0.0, -np.inf, np.inf), np.where(c < 0.0, np.inf, -np.inf)
    root = b * b - a * c
    width = np.sqrt(np.maximum(root, 0.0))
    return (
        np.where(root > 0.0, (-b - width) / a, np.inf),
        np.where(root > 0.0, (-b + width) / a, -np.inf),
    )


def in_cylinder(o: Array, d: Array, size: Array) -> tuple[Array, Array]:
    """Part of each line in the cylinder of radius size[0] and half length size[1] about z."""
    enter, leave = in_unit_ball(o[:, :2] / size[0], d[:2] / size[0])
    low, high = between(o[:, 2:], d[2:], size[1:2])
    return np.maximum(enter, low), np.minimum(leave, high)


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
        return Section("ellipse", (radius, radius), -height * z, np.stack([x, y]))

    def interval(self, o: Array, d: Array) -> tuple[Array, Array]:
        return in_unit_ball(o / self.size[0], d / self.size[0])

    def patches(self) -> tuple[Array, Array]:
        radius = float(self.size[0])
        return revolved(capsule_profile(radius, 0.0, 2.0 * radius / FINENESS, ARC))

    def triangles(self) -> Mesh:
        return swept_triangles(capsule_profile(self.size[0], 0.0, np.inf, 2 * ARC))

    def landmarks(self) -> Array:
        return np.asarray(self.size[0] * DIRECTIONS)


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
        return revolved(capsule_profile(radius, half_length, longest, ARC))

    def triangles(self) -> Mesh:
        return swept_triangles(capsule_profile(self.size[0], self.size[1], np.inf, 2 * ARC))

    def landmarks(self) -> Array:
        return np.asarray(self.size[0] * DIRECTIONS + np.sign(AROUND) * [0.0, 0.0, self.size[1]])

    def thickened(self, half: float) -> Shape:
        radius, half_length, unused = self.size
        return ShapeCapsule(np.array([max(radius, half), half_length, unused]))


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
        return revolved(cylinder_profile(radius, half_length, longest))

    def triangles(self) -> Mesh:
        return swept_triangles(cylinder_profile(self.size[0], self.size[1], np.inf))

    def landmarks(self) -> Array:
        across = np.linalg.norm(AROUND[:, :2], axis=1, keepdims=True)
        ring = AROUND[:, :2] / np.maximum(across, 1.0)
        return np.concatenate([self.size[0] * ring, self.size[1] * AROUND[:, 2:]], axis=1)

    def endless(self, rotation: Array, height: float) -> Shape:
        if int(np.argmax(np.abs(rotation[2]))) != 2:
            return self
        return ShapeCylinder(np.array([self.size[0], ENDLESS, self.size[2]]))


class Triaxial(Primitive):
    """A shape with a half size along each of its axes; its cross-sections are of one `family`."""

    family: ClassVar[str]

    @property
    def reach(self) -> Array:
        return np.where(self.size < ENDLESS, self.size, 0.0)

    @property
    def thickness(self) -> float:
        return float(2.0 * self.size.min())

    @abstractmethod
    def cut(self, k: int, height: float) -> Array:
        """(3,) half sizes of the cross-section at `height` m along axis k; entry k has no meaning.

        raises  ValueError when it is empty
        """

    def section(self, rotation: Array, height: float) -> Section:
        z = rotation[2]
        k = upright_axis(z)
        first, second = (k + 1) % 3, (k + 2) % 3
        axes = np.stack([np.eye(3)[first], np.sign(z[k]) * np.eye(3)[second]])
        half = self.cut(k, height)
        return Section(self.family, (float(half[first]), float(half[second])), -height * z, axes)

    def endless(self, rotation: Array, height: float) -> Shape:
        size = self.size.copy()
        size[int(np.argmax(np.abs(rotation[2])))] = ENDLESS
        return type(self)(size)


class ShapeBox(Triaxial):
    """Box of half extents size."""

    kind, code, family = "box", BOX, "rectangle"

    @property
    def volume(self) -> float:
        a, b, c = (float(s) for s in self.size)
        return 8.0 * a * b * c

    def cut(self, k: int, height: float) -> Array:
        if abs(height) >= self.size[k]:
            raise ValueError("misses the plane z = 0")
        return self.size

    def interval(self, o: Array, d: Array) -> tuple[Array, Array]:
        return between(o, d, self.size)

    def patches(self) -> tuple[Array, Array]:
        half = self.size
        longest = 2.0 * float(half.max()) / FINENESS
        centres, vectors = [], []
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            ni, nj = parts(2.0 * half[i], longest), parts(2.0 * half[j], longest)
            for side in (-1.0, 1.0):
                centre = np.empty((ni, nj, 3))
                centre[..., i] = (half[i] * ((2.0 * np.arange(ni) + 1.0) / ni - 1.0))[:, None]
                centre[..., j] = half[j] * ((2.0 * np.arange(nj) + 1.0) / nj - 1.0)
                centre[..., k] = side * half[k]
                vector = np.zeros((ni * nj, 3))
                vector[:, k] = side * 4.0 * half[i] * half[j] / (ni * nj)
                centres.append(centre.reshape(-1, 3))
                vectors.append(vector)
        return np.concatenate(centres), np.concatenate(vectors)

    def triangles(self) -> Mesh:
        faces = np.concatenate([SIDES[:, [0, 1, 2]], SIDES[:, [0, 2, 3]]])
        return CORNERS * self.size, faces

    def landmarks(self) -> Array:
        return np.asarray(AROUND * self.size)

    def outermost(self) -> Array:
        return np.asarray(CORNERS * self.size)


class ShapeEllipsoid(Triaxial):
    """Ellipsoid of semi-axes size."""

    kind, code, family = "ellipsoid", ELLIPSOID, "ellipse"

    @property
    def volume(self) -> float:
        a, b, c = (float(s) for s in self.size)
        return 4.0 / 3.0 * np.pi * a * b * c

    def cut(self, k: int, height: float) -> Array:
        return np.asarray(self.size * chord(self.size[k], height) / self.size[k])

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


PRIMITIVES: dict[str, type[Primitive]] = {
    shape.kind: shape
    for shape in (ShapeSphere, ShapeCapsule, ShapeCylinder, ShapeBox, ShapeEllipsoid)
}


def shape_of(kind: str, size: Array, mesh: Mesh | None) -> Shape:
    """A geometry of MuJoCo.

    kind  as MJCF spells it
    size  (3,) MuJoCo's half sizes, m
    mesh  of kind "mesh"; None for the others
    """
    return PRIMITIVES[kind](size) if mesh is None else ShapeMesh(*mesh)
