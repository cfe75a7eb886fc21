"""Surfaces of the bodies: flat patches for a simple wind, and the outermost points."""

from __future__ import annotations

import weakref
from dataclasses import dataclass

import numpy as np

from flowborne.kernels.arrays import Array, Integers
from flowborne.shapes.round import parts
from flowborne.shapes.section import Section
from flowborne.shapes.shape import FINENESS
from flowborne.solids.dynamics import kinematics
from flowborne.solids.model import SolidModel
from flowborne.solids.scratch import posed

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

    body: Integers
    centre: Array
    normal: Array
    area: Array
    screw: Array


_known: weakref.WeakKeyDictionary[SolidModel, Patches] = weakref.WeakKeyDictionary()


def surfaces(model: SolidModel) -> Patches:
    """Patches of every geometry, none longer than an eighth of it; in a slab, of every outline.

    Boxes and meshes keep their exact area. Round shapes are inscribed polyhedra: their area is too
    small by 0.04 % in a slab, by 0.2 % (cylinder) to 0.8 % (sphere) in three dimensions. Patches
    inside another geometry of the same body are kept; geometries inside flesh have none.
    """
    patches = _known.get(model)
    if patches is None:
        patches = _known[model] = _surfaces(model)
    return patches


def _surfaces(model: SolidModel) -> Patches:
    bodies, centres, vectors = [np.zeros(0, np.int64)], [np.zeros((0, 3))], [np.zeros((0, 3))]
    for g in np.argsort(model.geom_body, kind="stable"):
        if model.geom_covered[g]:
            continue
        shape = model.geom_shape[g]
        centre, vector = (
            _outline(shape.section(*model.rest_pose(g))) if model.slab else shape.patches()
        )
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


def _outline(section: Section) -> tuple[Array, Array]:
    """Centres and outward length vectors of a cross-section's outline, in its geometry's frame."""
    segments = section.outline(SLAB_ARC)
    longest = float(np.ptp(segments.reshape(-1, 3), axis=0).max()) / FINENESS
    up = np.cross(section.axes[0], section.axes[1])
    centres, vectors = [], []
    for start, end in segments:
        count = parts(float(np.linalg.norm(end - start)), longest)
        share = (np.arange(count) + 0.5) / count
        centres.append(start + share[:, None] * (end - start))
        vectors.append(np.tile(np.cross(end - start, up) / count, (count, 1)))
    return np.concatenate(centres), np.concatenate(vectors)


class Outline:
    """The outermost points of the bodies, without flesh, for any pose at little cost.

    body  (n,) body of each point
    mass  (n,) share of its body's mass, kg
    """

    def __init__(self, model: SolidModel) -> None:
        self._model = model
        self._local = [shape.outermost() for shape in model.geom_shape]
        counts = [len(points) for points in self._local]
        self.body: Integers = np.repeat(model.geom_body, counts)
        shared = np.bincount(self.body, minlength=model.nbody)[self.body]
        self.mass: Array = model.body_mass[self.body] / shared

    def at(self, q: Array) -> Array:
        """(n, 3) the points in the world, m, with the joints at `q` (nq,)."""
        s = posed(self._model, q)
        position, rotation = s.geom_xpos, s.geom_xmat.reshape(-1, 3, 3)
        placed = [
            position[g] + local @ rotation[g].T
            for g, local in zip(self._model.geom_id, self._local, strict=True)
        ]
        return np.concatenate(placed) if placed else np.zeros((0, 3))


def geom_boxes(model: SolidModel, q: Array) -> tuple[Array, Array]:
    """(ngeom, 3) lowest and highest corners of boxes around the geometries at `q` (nq,), m.

    Those of boxes and meshes touch them; those of tilted round shapes may be larger.
    """
    pose, reach = kinematics(model, q), model.mj.geom_aabb[model.geom_id]
    centre = pose.geom_position + np.einsum("gij,gj->gi", pose.geom_rotation, reach[:, :3])
    half = np.einsum("gij,gj->gi", np.abs(pose.geom_rotation), reach[:, 3:])
    low, high = centre - half, centre + half
    for g, shape in enumerate(model.geom_shape):
        if (skin := shape.skin()) is not None:
            corners = pose.geom_position[g] + skin[0] @ pose.geom_rotation[g].T
            low[g], high[g] = corners.min(axis=0), corners.max(axis=0)
    return low, high
