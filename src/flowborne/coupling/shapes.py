"""Signed distance to the geometries that a body is made of."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flowborne.fluid.grid import Grid
from flowborne.kernels.arrays import Array, Integers, Mask, Mesh
from flowborne.kernels.distance import SPHERE, Samples
from flowborne.kernels.edge_crossings import Placed
from flowborne.shapes.mesh import ShapeThickened, smooth_sheets
from flowborne.shapes.shape import Shape
from flowborne.solids.model import SolidModel

WATERTIGHT = {True: np.sqrt(2.0) / 2.0 * 1.01, False: np.sqrt(3.0) / 2.0 * 1.01}
"""Half thickness, in cells, from which a sheet blocks every face it passes (slab or not).

A sheet holds an unbroken chain of closed faces at every angle when it is as thick as the diagonal
of a cell. A thinner body is seen by the fluid as that thick; its mass and its displaced volume
stay its own.
"""

UNSAMPLED = Samples(np.zeros(3), 1.0, np.zeros((1, 1, 1)))


@dataclass(frozen=True)
class Shapes:
    """Geometries as the grid sees them, each in its own frame.

    kind    (ng,) SPHERE .. MESH
    size    (ng, 3) half extents in m: radius first, half length second for capsule and cylinder
    reach   (ng, 3) half extents of the bounding box in the geometry's frame, m
    body    (ng,) body that the geometry belongs to, ascending
    source  (ng,) index of the geometry in the model
    samples (ng) of the distance to those without a formula, in a room; of others UNSAMPLED
    skins   geometry -> vertices and faces to which distances near by are exact
    pieces  geometry -> smooth sheet of each of these faces
    sheets  (ng,) whether the samples are of sheets within a skin
    """

    kind: Integers
    size: Array
    reach: Array
    body: Integers
    source: Integers
    samples: list[Samples]
    skins: dict[int, Mesh]
    pieces: dict[int, Integers]
    sheets: Mask

    def placed(self, position: Array, rotation: Array) -> list[Placed]:
        """The geometries at positions (ng, 3), m, and in rotations (ng, 3, 3), for kernels."""
        own = self.kind.tolist(), self.size, position, rotation, self.samples
        return [Placed(*each) for each in zip(*own, strict=True)]

    @cached_property
    def geoms(self) -> dict[int, Integers]:
        """Body -> its geometries, ascending."""
        return {int(body): np.flatnonzero(self.body == body) for body in np.unique(self.body)}

    @cached_property
    def tips(self) -> Array:
        """(ng, 8, 3) corners of the bounding box of each in its own frame, m; of a sphere, which
        turns on the spot, its centre."""
        corners = np.stack(np.meshgrid(*[[-1.0, 1.0]] * 3), axis=-1).reshape(-1, 3)
        reach = np.where((self.kind == SPHERE)[:, None], 0.0, self.reach)
        return np.asarray(reach[:, None] * corners)


def shapes(model: SolidModel, grid: Grid) -> Shapes:
    """Geometries of `model` as `grid` sees them: thickened to be watertight, endless in a slab."""
    order = np.argsort(model.geom_body, kind="stable")
    chosen = [int(g) for g in order if not model.geom_covered[g]]
    seen = [seen_shape(model, g, grid) for g in chosen]
    sampled = [None if grid.is_slab else shape.samples(grid.spacing) for shape in seen]
    skins = {n: skin for n, shape in enumerate(seen) if (skin := shape.skin()) is not None}
    return Shapes(
        np.array([shape.code for shape in seen], np.int64),
        np.array([shape.size for shape in seen]).reshape(-1, 3),
        np.array([shape.reach for shape in seen]).reshape(-1, 3),
        np.asarray(model.geom_body)[chosen].astype(np.int64),
        np.array(chosen, np.int64),
        [UNSAMPLED if samples is None else samples for samples in sampled],
        skins,
        {n: smooth_sheets(*skin) for n, skin in skins.items()},
        np.array([isinstance(shape, ShapeThickened) for shape in seen], bool),
    )


def own_shape(model: SolidModel, geom: int, grid: Grid) -> Shape:
    """A geometry of `model`; in a slab what is of it in the plane, endless along z."""
    shape = model.geom_shape[geom]
    return shape.endless(*model.rest_pose(geom)) if grid.is_slab else shape


def seen_shape(model: SolidModel, geom: int, grid: Grid) -> Shape:
    """The same as the fluid sees it: thick enough to be watertight."""
    return own_shape(model, geom, grid).thickened(WATERTIGHT[grid.is_slab] * grid.spacing)
