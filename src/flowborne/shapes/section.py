"""Cross-sections at z = 0 of the geometries of a slab, per unit depth."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from flowborne.kernels.arrays import Array
from flowborne.shapes.thickness import split_quads, thin_parts

TIP_ARC = 64
"""Sides of round outlines in the search for tips."""

ALIGNED_SINE = 1e-6
"""Largest sine of the angle between a local axis and the z axis that counts as 0."""


@dataclass(frozen=True)
class Section:
    """Cross-section of one geometry, in the frame of the geometry.

    family    "rectangle", "ellipse", "stadium" or "segments"
    half      (2,) half extents along `axes`; for a stadium half length of the straight part, radius
    centre    (3,) centre of the section, m
    axes      (2, 3) unit vectors that span the plane; axes[0] x axes[1] is the world's z
    segments  (k, 2, 2) oriented outline of a mesh in the coordinates of `axes` about `centre`, with
              the material on the left; empty for the other families
    """

    family: str
    half: tuple[float, float]
    centre: Array
    axes: Array
    segments: Array = field(default_factory=lambda: np.zeros((0, 2, 2)))

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
        """(k, 2, 3) oriented outline in the frame of the geometry; `arc` segments per full turn."""
        if self.family == "segments":
            plane = self.segments
        else:
            points = self._corners(arc)
            plane = np.stack([points, np.roll(points, -1, axis=0)], axis=1)
        return np.asarray(self.centre + plane @ self.axes)

    def tips(self, width: float) -> float:
        """Length of its tips along the outline, where no disc of diameter `width` m fits in, m."""
        start, end = np.moveaxis(self.outline(TIP_ARC), 1, 0)
        rise, first = 0.5 * width * np.cross(*self.axes), np.arange(len(start))
        sides = split_quads(*(first + k * len(start) for k in range(4)))
        return thin_parts(np.concatenate([start, end, end + rise, start + rise]), sides, width)

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


def chord(radius: float, height: float) -> float:
    """Radius of the circle that a plane at `height` cuts from a sphere."""
    if abs(height) >= radius:
        raise ValueError("misses the plane z = 0")
    return float(np.sqrt(radius**2 - height**2))


def upright_axis(z: Array) -> int:
    """Index of the local axis along the world's z, given as local components `z`."""
    k = int(np.argmax(np.abs(z)))
    if np.hypot(z[(k + 1) % 3], z[(k + 2) % 3]) > ALIGNED_SINE:
        raise ValueError("has no local axis along z")
    return k
