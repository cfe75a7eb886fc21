"""Flesh on the grid: which faces its skin closes, and which of its vertices move them.

The velocity of a closed part of a face is that of the skin at the point nearest to the face's
centre, between the three vertices of a triangle; the force that pressure exerts on that part is
shared among the same vertices by the same weights.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne.coupling.images import displaced
from flowborne.coupling.shapes import WATERTIGHT
from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.grid import Grid, faces_of
from flowborne.kernels.arrays import Array, Integers
from flowborne.kernels.closed_fractions import Piece
from flowborne.kernels.edge_crossings import PIECES, Crossings, new_crossings
from flowborne.kernels.node_distance import BAND, NEAR
from flowborne.kernels.skin import cross_skin, sample_skin, skin_box, skin_weights
from flowborne.solids.flesh import Flesh


@dataclass(frozen=True)
class Skins:
    """The skin of every flesh.

    pieces    once for each of its images that reaches the grid. Flesh too thin to be watertight
              (`shapes.WATERTIGHT`) is seen as thick as that, and no edges cross it
    middle    (nf, 3) of the box around each flesh, m
    vertices  (n, 3) m;  triangles  (k, 3)
    """

    pieces: tuple[Piece, ...]
    middle: Array
    vertices: Array
    triangles: Integers


def piece_of(body: int, grid: Grid, box: Integers, phi: Array, crossings: Crossings) -> Piece:
    """A body, or an image of it, on the grid, as yet without what it closes.

    grid  displaced such that the body itself is there
    """
    sizes = (box[:, 1] - box[:, 0] - 1 + np.eye(3, dtype=np.int64)).tolist()
    share = faces_of([np.zeros(size) for size in sizes])
    centre = faces_of([np.zeros((2, *size)) for size in sizes])
    return Piece(body, box, grid.nodes, phi, crossings, share, centre)


def skins_on(
    grid: Grid, sides: Boundaries, flesh: Flesh | None, vertices: Array, bodies: int
) -> Skins:
    """The skins of flesh whose vertices are at `vertices` (n, 3), numbered after so many bodies."""
    if flesh is None:
        return Skins((), np.zeros((0, 3)), vertices, np.zeros((0, 3), np.int64))
    thinnest = 2.0 * WATERTIGHT[grid.is_slab] * grid.spacing
    near = BAND if grid.is_slab else NEAR + 1.0  # so far are the corners of faces that are near
    pieces, middles = [], []
    for f, triangles in enumerate(flesh.skins):
        inside = vertices[flesh.outer[f]]
        low, high = inside.min(axis=0), inside.max(axis=0)
        middles.append(0.5 * (low + high))
        more = max(0.0, 0.5 * (thinnest - flesh.thickness[f]))
        for image in displaced(grid, sides, low, high):
            box = skin_box(inside, image.nodes, np.array(grid.shape))
            if grid.is_slab:
                box[2] = 0, 2
            if np.any(box[:, 1] - box[:, 0] < 2):
                continue
            phi = sample_skin(vertices, triangles, box, image.nodes, near + more / grid.spacing)
            found = new_crossings(phi, grid.spacing, grid.is_slab)
            if more == 0.0:
                skin = vertices, triangles, (-1 - f) * PIECES + flesh.sheets[flesh.of_surface == f]
                cross_skin(found, np.zeros(1, np.int64), phi, *skin, box, image.nodes)
            pieces.append(piece_of(bodies + f, grid, box, phi - more, found))
    return Skins(tuple(pieces), np.array(middles), vertices, flesh.surface)


def face_centres(axis: Integers, face: Integers, grid: Grid) -> tuple[Array, Integers]:
    """(n, 3) centres of faces in m, z = 0 in a slab, and (n, 3) their indices along each axis."""
    x, at = np.empty((axis.size, 3)), np.empty((axis.size, 3), np.int64)
    for d in grid.axes:
        across = axis == d
        at[across] = np.stack(np.unravel_index(face[across], grid.face_shape(d)), axis=1)
        x[across] = at[across] + 0.5 * (np.arange(3) != d)
    x = np.array(grid.origin) + grid.spacing * x
    if grid.is_slab:
        x[:, 2] = 0.0
    return x, at


def skin_at(skins: Skins, place: Array, grid: Grid) -> tuple[Integers, Array]:
    """(n, 3) vertices and weights of the point of the skin that is nearest to each place (n, 3)."""
    return skin_weights(place, skins.vertices, skins.triangles, grid.spacing)


def hydrostatic_push(vertices: Array, triangles: Integers, gravity: Array, density: float) -> Array:
    """(3n,) force of the pressure of fluid at rest, rho g . x, on the vertices of skins, N.

    The pressure is that above the middle of them all: flesh that dives is not squeezed by depth,
    which true flesh hardly yields to, and a closed skin is borne by the same force.
    """
    corners = vertices[triangles]
    corners -= corners.mean(axis=(0, 1))
    area = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    pressure = density * (corners @ gravity)
    # of a pressure linear over the triangle: its nodes bear (2 p_i + p_j + p_k) / 12 of the area
    share = (pressure + pressure.sum(axis=1, keepdims=True)) / 12.0
    force = np.zeros_like(vertices)
    np.add.at(force, triangles, -share[:, :, None] * area[:, None, :])
    return force.ravel()
