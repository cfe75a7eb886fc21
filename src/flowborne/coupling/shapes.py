"""Signed distance to the geometries that a body is made of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flowborne.fluid.grid import Array, Grid
from flowborne.kernels.distance import BOX, CAPSULE, CYLINDER, ELLIPSOID, MESH, SPHERE
from flowborne.kernels.mesh_distance import sample_mesh
from flowborne.solids.model import SolidModel

ENDLESS = 1e30
"""Half extent along z of a geometry's cross-section in a slab, in m."""

WATERTIGHT = {True: np.sqrt(2.0) / 2.0 * 1.01, False: np.sqrt(3.0) / 2.0 * 1.01}
"""Half thickness, in cells, from which a sheet blocks every face it passes (slab or not).

A sheet holds an unbroken chain of closed faces at every angle when it is as thick as the diagonal
of a cell. A thinner body is seen by the fluid as that thick; its mass and its displaced volume
stay its own.
"""


@dataclass(frozen=True)
class Shapes:
    """Geometries as the grid sees them, each in its own frame.

    kind    (ng,) SPHERE .. MESH
    size    (ng, 3) half extents in m: radius first, half length second for capsule and cylinder
    reach   (ng, 3) half extents of the bounding box in the geometry's frame, m
    body    (ng,) body that the geometry belongs to, ascending
    source  (ng,) index of the geometry in the model
    tables  samples of the distance to each mesh, flat, one after another
    table   (ng, 4) first sample, then counts along x, y, z
    corner  (ng, 3) first sample's place in the geometry's frame, m
    pitch   (ng,) distance between samples, m
    """

    kind: NDArray[np.int64]
    size: Array
    reach: Array
    body: NDArray[np.int64]
    source: NDArray[np.int64]
    tables: Array
    table: NDArray[np.int64]
    corner: Array
    pitch: Array


MESH_SAMPLES = 40
"""Samples of a mesh's distance table along its longest side."""


def shapes(model: SolidModel, grid: Grid) -> Shapes:
    """Geometries of `model` as `grid` sees them: thickened to be watertight, endless in a slab."""
    thinnest = WATERTIGHT[grid.is_slab] * grid.spacing
    order = np.argsort(model.geom_body, kind="stable")
    kinds = {"sphere": 0, "capsule": 1, "cylinder": 2, "box": 3, "ellipsoid": 4, "mesh": 5}
    chosen = [int(g) for g in order if model.geom_type[g] in kinds and not model.geom_covered[g]]
    count = len(chosen)
    kind = np.zeros(count, np.int64)
    size, reach = np.ones((count, 3)), np.ones((count, 3))
    table, corner, pitch = np.zeros((count, 4), np.int64), np.zeros((count, 3)), np.ones(count)
    tables: list[Array] = []
    first = 0
    rest = model.rest_geom_rotation()
    for n, g in enumerate(chosen):
        kind[n] = kinds[str(model.geom_type[g])]
        size[n] = np.maximum(model.geom_size[g], thinnest)
        if kind[n] == SPHERE:
            reach[n] = size[n, 0]
        elif kind[n] == CAPSULE:
            size[n, 1] = model.geom_size[g, 1]
            reach[n] = size[n, 0], size[n, 0], size[n, 0] + size[n, 1]
        elif kind[n] == CYLINDER:
            reach[n] = size[n, 0], size[n, 0], size[n, 1]
        elif kind[n] == MESH:
            vertices, faces = model.mesh_of(g)
            low, high = vertices.min(axis=0), vertices.max(axis=0)
            pitch[n] = float((high - low).max()) / MESH_SAMPLES
            corner[n] = low - 3.0 * pitch[n]
            counts = np.ceil((high - low) / pitch[n]) + 7.0
            tables.append(sample_mesh(vertices, faces, corner[n], pitch[n], counts))
            table[n] = first, *counts.astype(np.int64)
            first += tables[-1].size
            reach[n] = np.maximum(np.abs(low), np.abs(high))
        else:
            reach[n] = size[n]
        if grid.is_slab:
            upright = int(np.argmax(np.abs(rest[g][2])))
            if kind[n] in (BOX, ELLIPSOID):
                size[n, upright] = ENDLESS
            elif kind[n] == CYLINDER and upright == 2:
                size[n, 1] = ENDLESS
    return Shapes(
        kind,
        size,
        reach,
        np.asarray(model.geom_body)[chosen].astype(np.int64),
        np.array(chosen, np.int64),
        np.concatenate(tables) if tables else np.zeros(1),
        table,
        corner,
        pitch,
    )
