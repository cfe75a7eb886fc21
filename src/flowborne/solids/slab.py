"""Cross-sections at z = 0 of the geometries of a slab, per unit depth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mesh = tuple[Array, NDArray[np.int64]]
"""Vertices (k, 3) and faces (m, 3), outward by the right-hand rule."""

ALIGNED = 1e-6
"""Largest sine of the angle by which a local axis may be off the z axis."""


@dataclass(frozen=True)
class Section:
    """Cross-section of one geometry, in the geometry's own frame.

    family    "rectangle", "ellipse", "stadium" or "segments"
    half      (2,) half extents along `axes`; for a stadium half length of the straight part, radius
    centre    (3,) centre of the section, m
    axes      (2, 3) unit vectors that span the plane; axes[0] x axes[1] is the world's z
    segments  (k, 2, 2) oriented outline of a mesh in the coordinates of `axes` about `centre`,
              material on its left; empty for the other families
    """

    family: str
    half: tuple[float, float]
    centre: Array
    axes: Array
    segments: Array

    @property
    def area(self) -> float:
        """Area, m^2."""
        a, b = self.half
        if self.family == "rectangle":
            return 4.0 * a * b
        if self.family == "ellipse":
            return float(np.pi * a * b)
        if self.family == "stadium":
            return float(4.0 * a * b + np.pi * b**2)
        return float(0.5 * cross(self.segments[:, 0], self.segments[:, 1]).sum())

    @property
    def centroid(self) -> Array:
        """(3,) centroid in the geometry's frame, m."""
        if self.family != "segments":
            return self.centre
        start, end = self.segments[:, 0], self.segments[:, 1]
        weight = cross(start, end) / (6.0 * self.area)
        return np.asarray(self.centre + (weight[:, None] * (start + end)).sum(axis=0) @ self.axes)

    @property
    def polar_moment(self) -> float:
        """Second moment of area about the z axis through the centroid, m^4."""
        a, b = self.half
        if self.family == "rectangle":
            return self.area * (a**2 + b**2) / 3.0
        if self.family == "ellipse":
            return self.area * (a**2 + b**2) / 4.0
        if self.family == "stadium":
            straight = 4.0 * a * b * (a**2 + b**2) / 3.0
            caps = np.pi * b**2 * (a**2 + b**2 / 2.0) + 8.0 / 3.0 * a * b**3
            return float(straight + caps)
        start, end = self.segments[:, 0], self.segments[:, 1]
        square = (start**2 + start * end + end**2).sum(axis=1)
        about_centre = float((cross(start, end) * square).sum() / 12.0)
        offset = self.axes @ (self.centroid - self.centre)
        return about_centre - self.area * float(offset @ offset)

    def outline(self, arc: int) -> Array:
        """(k, 2, 3) oriented outline segments in the geometry's frame; `arc` of them a turn."""
        if self.family == "segments":
            plane = self.segments
        else:
            points = self._corners(arc)
            plane = np.stack([points, np.roll(points, -1, axis=0)], axis=1)
        return np.asarray(self.centre + plane @ self.axes)

    def _corners(self, arc: int) -> Array:
        a, b = self.half
        if self.family == "rectangle":
            return np.array([[-a, -b], [a, -b], [a, b], [-a, b]])
        if self.family == "ellipse":
            angle = 2.0 * np.pi * np.arange(arc) / arc
            return np.stack([a * np.cos(angle), b * np.sin(angle)], axis=1)
        angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, arc // 2 + 1)
        cap = np.stack([a + b * np.cos(angle), b * np.sin(angle)], axis=1)
        return np.concatenate([cap, -cap]) if a > 0.0 else np.concatenate([cap, -cap[1:-1]])


def cross(a: Array, b: Array) -> Array:
    """(k,) z component of the product of plane vectors (k, 2)."""
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def section(kind: str, size: Array, rotation: Array, height: float, mesh: Mesh | None) -> Section:
    """Cross-section at z = 0 of a geometry whose centre is at z = `height`.

    kind      "sphere", "capsule", "cylinder", "box", "ellipsoid" or "mesh"
    size      (3,) MuJoCo's half sizes, m
    rotation  (3, 3) geometry's frame to the world's
    mesh      vertices in the geometry's frame and faces, for a mesh
    raises    ValueError when no local axis is along z or the geometry misses the plane z = 0
    """
    x, y, z = rotation
    foot = -height * z
    none = np.zeros((0, 2, 2))
    if kind == "mesh":
        if mesh is None:
            raise ValueError("mesh has no triangles")
        return mesh_section(mesh, z, height, np.stack([x, y]), foot)
    if kind == "sphere":
        radius = chord(size[0], height)
        return Section("ellipse", (radius, radius), foot, np.stack([x, y]), none)
    if kind in ("capsule", "cylinder"):
        return round_section(kind, size, z, height)
    k = upright_axis(z)
    first, second = (k + 1) % 3, (k + 2) % 3
    sign = np.sign(z[k])
    axes = np.stack([np.eye(3)[first], sign * np.eye(3)[second]])
    half = np.array([size[first], size[second]])
    if kind == "ellipsoid":
        half = half * chord(size[k], height) / size[k]
        return Section("ellipse", (float(half[0]), float(half[1])), foot, axes, none)
    if abs(height) >= size[k]:
        raise ValueError("misses the plane z = 0")
    return Section("rectangle", (float(half[0]), float(half[1])), foot, axes, none)


def chord(radius: float, height: float) -> float:
    """Radius of the circle that a plane at `height` cuts from a sphere."""
    if abs(height) >= radius:
        raise ValueError("misses the plane z = 0")
    return float(np.sqrt(radius**2 - height**2))


def upright_axis(z: Array) -> int:
    """Index of the local axis along the world's z, whose local components are `z`."""
    k = int(np.argmax(np.abs(z)))
    if np.hypot(z[(k + 1) % 3], z[(k + 2) % 3]) > ALIGNED:
        raise ValueError("has no local axis along z")
    return k


def round_section(kind: str, size: Array, z: Array, height: float) -> Section:
    """Cross-section of a capsule or cylinder (local z is its axis): upright or lying."""
    radius, half_length = float(size[0]), float(size[1])
    foot, none = -height * z, np.zeros((0, 2, 2))
    if np.hypot(z[0], z[1]) <= ALIGNED:
        beyond = max(abs(height) - half_length, 0.0)
        if kind == "cylinder" and beyond > 0.0:
            raise ValueError("misses the plane z = 0")
        cut = chord(radius, beyond)
        axes = np.array([[1.0, 0.0, 0.0], [0.0, np.sign(z[2]), 0.0]])
        return Section("ellipse", (cut, cut), foot, axes, none)
    if abs(z[2]) > ALIGNED:
        raise ValueError("has no local axis along z")
    cut = chord(radius, height)
    along = np.array([0.0, 0.0, 1.0])
    axes = np.stack([along, np.cross(z, along)])
    family = "stadium" if kind == "capsule" else "rectangle"
    return Section(family, (half_length, cut), foot, axes, none)


def mesh_section(mesh: Mesh, z: Array, height: float, axes: Array, foot: Array) -> Section:
    """Cross-section of a closed mesh: one oriented segment for each triangle that is cut.

    A vertex in the plane counts as just above it, so that the outline closes.
    """
    vertices, faces = mesh
    level = vertices @ z + height
    above = level[faces] >= 0.0
    cut = np.flatnonzero(above.any(axis=1) & ~above.all(axis=1))
    if cut.size == 0:
        raise ValueError("misses the plane z = 0")
    plane = (vertices - foot) @ axes.T
    segments = np.empty((cut.size, 2, 2))
    for n, triangle in enumerate(faces[cut]):
        for i in range(3):
            a, b = triangle[i], triangle[(i + 1) % 3]
            up = level[b] >= 0.0
            if (level[a] >= 0.0) != up:
                share = level[a] / (level[a] - level[b])
                segments[n, 0 if up else 1] = plane[a] + share * (plane[b] - plane[a])
    section = Section("segments", (0.0, 0.0), foot, axes, segments)
    if section.area < 0.0:
        segments = segments[:, ::-1]
    return Section("segments", (0.0, 0.0), foot, axes, np.ascontiguousarray(segments))
