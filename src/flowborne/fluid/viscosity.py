"""Implicit viscosity on cut cells, with no-slip bodies that may move freely.

The velocity u_f of a face is the mean over its open part a_f, that at the centre of this. In a cell
of open part v between two faces, Gauss's theorem gives the derivative across them, of one at a
wall that moves with b,

    v h du/dx = a_E (u_E - b) - a_W (u_W - b)

and in the plane of the faces du/dy is the difference of two over the distance of their centres,
or at a wall u_f - b over that of f's centre from it (Cheny and Botella 2010). What  mu v h^d
(du/dx)^2 / 2  and the like dissipate, links k and wall coefficients W follow from,

    m (u+ - u*) / dt = sum_g k (u_g - u_f) - sum W (u_f - b)

symmetric and positive definite, though one W of the two faces of a cut cell is below 0. Along any
plane wall in a slab a linear shear is exact, and so are the force that each cut cell and each cut
face feels, and a rigid rotation of fluid and body together: b is taken at the middle of the wall's
piece. In rooms the links in the plane of the faces leave out that centres may be apart askew.

That friction belongs to the stress mu grad u. What mu (grad u)^T adds sums up to a couple on each
body that the fluid does not feel: on a no-slip wall the whole stress is mu times the normal
derivative of the velocity relative to the body, its rotation taken off, or  W (u_f - b_f)  with
the body's velocity at the face. A body of volume V and spin w feels  -2 mu V w  besides.

Method: docs/method/viscosity.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import prod
from typing import NamedTuple

import numpy as np

from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.ghosts import edge
from flowborne.fluid.grid import Grid
from flowborne.kernels.arrays import PERIODIC, PRESCRIBED, Array, Faces, Integers, Marks
from flowborne.kernels.corner_friction import corner_stiffness, find_corners
from flowborne.kernels.edge_crossings import Crossings
from flowborne.kernels.node_distance import NEAR
from flowborne.kernels.viscosity import (
    GIVEN,
    INACTIVE,
    UNKNOWN,
    CutFaces,
    face_distances,
    find_centres,
    link_faces,
    meet_walls,
)

SIDE_MASS = 0.75
"""Part of the mass of the faces along a side with friction that this slows down: what
lies nearer to them than to the side. With it a parabola is exact."""


class Corners(NamedTuple):
    """What corners of bodies add to the matrix, see `kernels.corner_friction`.

    faces   (c, 5) flat indices of the faces around each
    matrix  (c, 5, 5) kg/s, whose diagonals are part of that of the system
    node    (c,) flat index of the node there that is nearest to a body
    """

    faces: Integers
    matrix: Array
    node: Integers


@dataclass
class ViscousFaces:
    """The viscous system of the faces across one axis; arrays have the shape of the faces.

    first     position of the component among the concatenated faces
    kind      INACTIVE, UNKNOWN or GIVEN
    all       (3, n) mass, diagonal and given of all components, over the concatenated faces
    links     (3, ...) k to the next face along each axis, between unknowns, kg/s
    centre    (2, ...) of each face's open part from that of the whole along the two other axes, m
    beside    (n,) flat indices of the unknowns beside a body, once for each piece of wall
    wall      (n,) W, kg/s
    gap       (n, 3) from the middle of the piece to the centre of the face's open part, m
    place     (n, 3) from the centre of the whole face to the middle of the piece, m
    node      (n,) flat index of the node there that is nearest to a body
    corners   what they add
    """

    first: int
    kind: Marks
    all: Array
    links: Array
    centre: Array
    beside: Integers
    wall: Array
    gap: Array
    place: Array
    node: Integers
    corners: Corners

    @property
    def part(self) -> slice:
        """Where the component is among the concatenated faces."""
        return slice(self.first, self.first + self.kind.size)

    @property
    def mass(self) -> Array:
        """m / dt, kg/s; see SIDE_MASS."""
        return self.all[0, self.part].reshape(self.kind.shape)

    @property
    def diagonal(self) -> Array:
        """m / dt + sum of links + W of unknowns, else 0, kg/s."""
        return self.all[1, self.part].reshape(self.kind.shape)


@dataclass(frozen=True)
class OpenParts:
    """What bodies leave open of the grid.

    distance   (nx+1, ny+1, nz+1) to the nearest body at the nodes, m
    crossings  of the edges with bodies
    faces      open part of each face
    cells      (nx, ny, nz) open volume of each, m^3
    """

    distance: Array
    crossings: Crossings
    faces: Faces
    cells: Array


def assemble_viscosity(
    cut: OpenParts,
    velocity: Faces,
    masses: Faces,
    grid: Grid,
    boundaries: Boundaries,
    viscosity: float,
    dt: float,
    time: float,
) -> list[ViscousFaces]:
    """The viscous system of each component.

    velocity  Faces; used where a side prescribes it
    masses    Faces, of the fluid that belongs to each face, kg
    time      s, of the sides' prescribed velocities
    """
    normal, periodic, h = boundaries.normal(), boundaries.periodic(), grid.spacing
    stiffness = viscosity * grid.face_area / h
    edges, parts = (cut.distance, cut.crossings), cut.cells / grid.cell_volume
    systems: list[ViscousFaces] = []
    whole = np.zeros((3, sum(prod(grid.face_shape(axis)) for axis in grid.axes)))
    wraps = np.array(grid.shape) * np.array(periodic)
    found = find_corners(*edges, h)
    for axis in grid.axes:
        shape, opened = grid.face_shape(axis), cut.faces[axis]
        kind, away = kinds_of_faces(opened, axis, normal), np.empty(shape)
        face_distances(cut.distance, axis, NEAR * h, away)
        near = np.flatnonzero((kind != INACTIVE) & (away <= 0.0))
        centre = np.zeros((2, *shape))
        find_centres(*edges, axis, near, centre, grid.is_slab)
        first, links = systems[-1].part.stop if systems else 0, np.zeros((3, *shape))
        mass, diagonal, given = whole[:, first : first + kind.size].reshape(links.shape)
        np.divide(masses[axis], dt, out=mass)
        stick_to_sides(diagonal, given, kind, stiffness, grid, boundaries, axis, time)
        mass[diagonal > 0.0] *= SIDE_MASS
        np.add(mass, diagonal, out=diagonal, where=kind == UNKNOWN)
        faces = CutFaces(axis, kind, *edges, opened, centre, parts, stiffness)
        for d in grid.axes:
            around = away, velocity[axis], diagonal, links[d], given
            link_faces(faces, d, *around, periodic[d])
        beside = near[kind.reshape(-1)[near] == UNKNOWN]
        wall, gap, place, node = meet_walls(faces, normal, beside)
        diagonal.reshape(-1)[beside] += wall.sum(axis=1)
        walls = links, beside, wall[:, 0], wraps
        corners = Corners(*corner_stiffness(faces, *found, *walls))
        np.add.at(diagonal.reshape(-1), corners.faces, np.einsum("nii->ni", corners.matrix))
        met = wall != 0.0
        beside = np.repeat(beside, met.sum(axis=1))
        pieces = beside, wall[met], h * gap[met], h * place[met], node[met]
        system = first, kind, whole, links, h * centre, *pieces, corners
        systems.append(ViscousFaces(*system))
    return systems


def kinds_of_faces(opened: Array, axis: int, normal: Integers) -> Marks:
    """Kind of every face across `axis` from its open part.

    normal  (3, 2) a of the velocity across the sides, see `fluid.sides.side`
    """
    kind = np.where(opened > 0.0, np.uint8(UNKNOWN), np.uint8(INACTIVE))
    for at, side in zip((0, -1), normal[axis], strict=True):
        layer = kind[edge(axis, at)]
        if side == PRESCRIBED:
            layer[layer == UNKNOWN] = GIVEN
        elif side == PERIODIC and at:
            layer[:] = INACTIVE
    return kind


def stick_to_sides(
    friction: Array,
    given: Array,
    kind: Marks,
    stiffness: float,
    grid: Grid,
    boundaries: Boundaries,
    axis: int,
    time: float,
) -> None:
    """Add the friction of the domain's sides on the faces across `axis`, kg/s, and the force of
    moving ones, N, in place."""
    for place, side in boundaries.around(grid):
        if place.axis != axis and side.tangential == PRESCRIBED:
            wall = side.prescribed_velocity(place, axis, time)
            coefficient = 2.0 * stiffness * (kind[place.layer] == UNKNOWN)
            friction[place.layer] += coefficient
            given[place.layer] += coefficient * wall
