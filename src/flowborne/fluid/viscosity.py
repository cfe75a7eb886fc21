"""Implicit viscosity on cut cells, with no-slip bodies that may move freely.

Finite volumes around every face f: with mass m, links k = mu A_open / h to its
neighbours g, and a wall coefficient W where a body closes a part of the links,

    m (u+ - u*) / dt = sum_g k (u_g - u_f) - W (u_f - b)        b = velocity of the body at x_w

The open links leave  n = sum_g k (x_g - x_f)  behind, mu times the wall's area along its normal.
W = sum_g k (d_g - d_f) / d_f with the distance d to the wall makes a linear shear exact, and the
wall point  x_w = x_f - n / W  makes a rigid rotation of body and fluid together exact; n / W is
the distance along the normal, and the wall's friction acts on the body at x_w.

That friction belongs to the stress mu grad u. What mu (grad u)^T adds sums up to a couple on each
body that the fluid does not feel: on a no-slip wall the whole stress is mu times the normal
derivative of the velocity relative to the body, its rotation taken off, or  W (u_f - b_f)  with
the body's velocity at x_f. A body of volume V and spin w feels  -2 mu V w  besides.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flowborne.fluid.boundary import Boundaries, BoundaryInflow, BoundaryNoSlip
from flowborne.fluid.ghosts import edge, wall_velocity
from flowborne.fluid.grid import Array, Faces, Grid
from flowborne.fluid.projection import side_codes
from flowborne.kernels.arrays import Integers
from flowborne.kernels.viscosity import UNKNOWN, classify, face_distances, link_faces, meet_walls

TOUCHING = 1e-3
"""Faces whose centres are not farther than this from a body move with it, cells."""

SIDE_MASS = 0.75
"""Part of the mass of the faces along a no-slip or inflow side that its friction slows down: what
lies nearer to them than to the side. With it a parabola is exact."""


@dataclass
class ViscousFaces:
    """The viscous system of the faces across one axis; arrays have the shape of the faces.

    kind      INACTIVE, UNKNOWN, GIVEN or TIED
    mass      m / dt, kg/s; see SIDE_MASS
    diagonal  m / dt + sum of links + W of unknowns, else 0, kg/s
    links     (3, ...) k to the next face along each axis, between unknowns, kg/s
    given     force of neighbours and sides with prescribed velocity, N
    beside    (n,) flat indices of the unknowns beside a body
    wall      (n,) W, kg/s
    gap       (n, 3) x_f - x_w of each, m
    """

    kind: NDArray[np.uint8]
    mass: Array
    diagonal: Array
    links: Array
    given: Array
    beside: Integers
    wall: Array
    gap: Array


def assemble_viscosity(
    distance: Array,
    opened: Faces,
    velocity: Faces,
    masses: Faces,
    grid: Grid,
    boundaries: Boundaries,
    viscosity: float,
    dt: float,
    time: float,
) -> list[ViscousFaces]:
    """The viscous system of each component.

    distance  (nx+1, ny+1, nz+1) to the nearest body at the nodes, m
    velocity  Faces; used where a side prescribes it
    masses    Faces, of the fluid that belongs to each face, kg
    time      s, of the sides' prescribed velocities
    """
    codes = side_codes(boundaries)
    periodic = boundaries.periodic()
    h = grid.spacing
    stiffness = viscosity * grid.face_area / h
    systems = []
    for axis in grid.axes:
        shape = grid.face_shape(axis)
        kind, phi = np.empty(shape, np.uint8), np.empty(shape)
        face_distances(distance, axis, phi)
        classify(kind, opened[axis], phi, axis, codes, TOUCHING * h)
        mass = masses[axis] / dt
        friction, given = stick_to_sides(kind, stiffness, grid, boundaries, axis, time)
        mass[(friction > 0.0) & (kind == UNKNOWN)] *= SIDE_MASS
        diagonal = np.where(kind == UNKNOWN, mass + friction, 0.0)
        links = np.zeros((3, *shape))
        for d in grid.axes:
            link_faces(
                axis,
                d,
                kind,
                opened[axis],
                opened[d],
                velocity[axis],
                stiffness,
                diagonal,
                links[d],
                given,
                periodic[d],
            )
        beside = np.flatnonzero((kind == UNKNOWN) & (phi < 2.0 * h))
        wall, gap = np.zeros(beside.size), np.zeros((beside.size, 3))
        meet_walls(axis, kind, opened, phi, stiffness, h, codes, beside, wall, gap)
        cut = wall > 0.0
        beside, wall, gap = beside[cut], wall[cut], gap[cut]
        diagonal.reshape(-1)[beside] += wall
        systems.append(ViscousFaces(kind, mass, diagonal, links, given, beside, wall, gap))
    return systems


def stick_to_sides(
    kind: NDArray[np.uint8],
    stiffness: float,
    grid: Grid,
    boundaries: Boundaries,
    axis: int,
    time: float,
) -> tuple[Array, Array]:
    """Friction of the domain's sides on the faces across `axis`, kg/s, and the force of moving
    ones, N."""
    friction, given = np.zeros(kind.shape), np.zeros(kind.shape)
    for d in grid.axes:
        for end, side in enumerate(boundaries.pair(d)):
            if d != axis and isinstance(side, (BoundaryInflow, BoundaryNoSlip)):
                layer = edge(d, -1 if end else 0)
                wall = wall_velocity(side, grid, d, bool(end), axis, time)
                if isinstance(wall, np.ndarray):
                    wall = wall[edge(d, 0)]
                coefficient = 2.0 * stiffness * (kind[layer] == UNKNOWN)
                friction[layer] += coefficient
                given[layer] += coefficient * wall
    return friction, given
