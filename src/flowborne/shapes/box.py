"""Block."""

from __future__ import annotations

from itertools import product

import numpy as np

from flowborne.kernels.distance import BOX
from flowborne.shapes.lines import between
from flowborne.shapes.round import parts
from flowborne.shapes.section import Section, upright_axis
from flowborne.shapes.shape import AROUND, ENDLESS, FINENESS, Array, Mesh, Primitive, Shape

CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))
SIDES = np.array(
    [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
)
"""Corners of each side in turn, outward."""


class ShapeBox(Primitive):
    """Block of half extents size."""

    kind, code = "box", BOX

    @property
    def volume(self) -> float:
        a, b, c = (float(s) for s in self.size)
        return 8.0 * a * b * c

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
        if abs(height) >= self.size[k]:
            raise ValueError("misses the plane z = 0")
        half = float(self.size[first]), float(self.size[second])
        return Section("rectangle", half, -height * z, axes, np.zeros((0, 2, 2)))

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

    def endless(self, rotation: Array, height: float) -> Shape:
        size = self.size.copy()
        size[int(np.argmax(np.abs(rotation[2])))] = ENDLESS
        return ShapeBox(size)
