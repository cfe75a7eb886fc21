"""Surfaces of the bodies as flat patches: what a simple wind blows on."""

from __future__ import annotations

import weakref
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flowborne.solids.model import SolidModel

Array = NDArray[np.float64]

FINENESS = 8
"""A geometry's longest side is divided into this many patches at least."""

ARC = 32
"""Patches around a circle in three dimensions."""

SLAB_ARC = 64
"""Patches around a circle in a slab."""


@dataclass(frozen=True)
class Patches:
    """Flat patches with the fluid on the side of their normal, in body frames.

    body    (n,) body, ascending
    centre  (n, 3) m
    normal  (n, 3) unit, outward
    area    (n,) m^2; length in a slab, m
    screw   (n, 6) normal n and centre x n
    """

    body: NDArray[np.int64]
    centre: Array
    normal: Array
    area: Array
    screw: Array


_known: weakref.WeakKeyDictionary[SolidModel, Patches] = weakref.WeakKeyDictionary()


def surfaces(model: SolidModel) -> Patches:
    """Patches of every geometry, none longer than an eighth of it; in a slab, of every outline.

    Boxes and meshes keep their area exactly. Round shapes are inscribed polyhedra: less area by
    0.04 % in a slab, by 0.2 % (cylinder) to 0.8 % (sphere) in three dimensions. Patches of one
    geometry that lie within another of the same body are not left out.
    """
    patches = _known.get(model)
    if patches is None:
        patches = _known[model] = _surfaces(model)
    return patches


def _surfaces(model: SolidModel) -> Patches:
    bodies, centres, vectors = [np.zeros(0, np.int64)], [np.zeros((0, 3))], [np.zeros((0, 3))]
    for g in np.argsort(model.geom_body, kind="stable"):
        centre, vector = _outline(model, int(g)) if model.slab else _skin(model, int(g))
        rotation = model.geom_rotation[g]
        centres.append(model.geom_offset[g] + centre @ rotation.T)
        vectors.append(vector @ rotation.T)
        bodies.append(np.full(len(centre), model.geom_body[g]))
    vector = np.concatenate(vectors)
    area = np.linalg.norm(vector, axis=1)
    real = area > 0.0
    centre, normal = np.concatenate(centres)[real], vector[real] / area[real, None]
    screw = np.concatenate([normal, np.cross(centre, normal)], axis=1)
    return Patches(np.concatenate(bodies)[real], centre, normal, area[real], screw)


def _outline(model: SolidModel, geom: int) -> tuple[Array, Array]:
    """Centres and outward length vectors of a slab geometry's outline, in its own frame."""
    section = model.section_of(geom)
    segments = section.outline(SLAB_ARC)
    longest = float(np.ptp(segments.reshape(-1, 3), axis=0).max()) / FINENESS
    up = np.cross(section.axes[0], section.axes[1])
    centres, vectors = [], []
    for start, end in segments:
        count = _parts(float(np.linalg.norm(end - start)), longest)
        share = (np.arange(count) + 0.5) / count
        centres.append(start + share[:, None] * (end - start))
        vectors.append(np.tile(np.cross(end - start, up) / count, (count, 1)))
    return np.concatenate(centres), np.concatenate(vectors)


def _skin(model: SolidModel, geom: int) -> tuple[Array, Array]:
    """Centres and outward area vectors of a geometry, in its own frame."""
    kind, size = model.geom_type[geom], model.geom_size[geom]
    if kind == "box":
        return _box(size)
    if kind == "mesh":
        import trimesh  # a tenth of a second that only meshes need

        vertices, faces = model.mesh_of(geom)
        longest = float(np.ptp(vertices, axis=0).max()) / FINENESS
        vertices, faces = trimesh.remesh.subdivide_to_size(vertices, faces, longest, max_iter=20)
        corners = vertices[faces]
        sides = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        return corners.mean(axis=1), 0.5 * np.cross(*sides)
    if kind == "ellipsoid":
        return _revolved(_sphere_profile(1.0, 0.0, 1.0), size)
    radius = float(size[0])
    length = 0.0 if kind == "sphere" else float(size[1])
    if kind == "cylinder":
        longest = 2.0 * max(radius, length) / FINENESS
        rise = np.linspace(-length, length, _parts(2.0 * length, longest) + 1)
        disc = np.linspace(0.0, radius, _parts(radius, longest) + 1)[:-1]
        profile = np.concatenate(
            [
                np.stack([disc, np.full(disc.size, -length)], axis=1),
                np.stack([np.full(rise.size, radius), rise], axis=1),
                np.stack([disc[::-1], np.full(disc.size, length)], axis=1),
            ]
        )
    else:
        profile = _sphere_profile(radius, length, 2.0 * (radius + length) / FINENESS)
    return _revolved(profile, np.ones(3))


def _parts(length: float, longest: float) -> int:
    return max(int(np.ceil(length / longest - 1e-9)), 1)


def _sphere_profile(radius: float, half_length: float, longest: float) -> Array:
    """(k, 2) distance from the axis and height, from pole to pole of a sphere or capsule."""
    angle = np.linspace(-0.5 * np.pi, 0.0, ARC // 4 + 1)
    below = np.stack([radius * np.cos(angle), radius * np.sin(angle) - half_length], axis=1)
    below[0, 0] = 0.0
    above = below[::-1] * [1.0, -1.0]
    if half_length == 0.0:
        return np.concatenate([below, above[1:]])
    rise = np.linspace(-half_length, half_length, _parts(2.0 * half_length, longest) + 1)[1:-1]
    return np.concatenate([below, np.stack([np.full(rise.size, radius), rise], axis=1), above])


def _revolved(profile: Array, scale: Array) -> tuple[Array, Array]:
    """Patches of the surface that a profile sweeps about z, stretched by `scale` (3,)."""
    angle = 2.0 * np.pi * np.arange(ARC + 1) / ARC
    angle[-1] = 0.0
    points = np.empty((len(profile), ARC + 1, 3))
    points[..., 0] = profile[:, :1] * np.cos(angle)
    points[..., 1] = profile[:, :1] * np.sin(angle)
    points[..., 2] = profile[:, 1:]
    points *= scale
    a, b, c, d = points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]
    return _quads(a.reshape(-1, 3), b.reshape(-1, 3), c.reshape(-1, 3), d.reshape(-1, 3))


def _quads(a: Array, b: Array, c: Array, d: Array) -> tuple[Array, Array]:
    """Centroids and area vectors of plane quadrangles given by corners in turn."""
    first, second = 0.5 * np.cross(b - a, c - a), 0.5 * np.cross(c - a, d - a)
    vector = first + second
    weight = np.linalg.norm(first, axis=1), np.linalg.norm(second, axis=1)
    total = np.maximum(weight[0] + weight[1], np.finfo(float).tiny)
    share = (weight[1] / total)[:, None]
    return (a + c + (1.0 - share) * b + share * d) / 3.0, vector


def _box(half: Array) -> tuple[Array, Array]:
    """Patches of a box of half sizes (3,)."""
    longest = 2.0 * float(half.max()) / FINENESS
    centres, vectors = [], []
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        ni, nj = _parts(2.0 * half[i], longest), _parts(2.0 * half[j], longest)
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
