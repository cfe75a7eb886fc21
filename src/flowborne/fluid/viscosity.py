"""Implicit viscosity on cut cells, with no-slip bodies that may move freely.

Finite volumes around every face f: with mass m = a rho V, links k = mu A_open / h to its
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
from numba import prange
from numpy.typing import NDArray

from flowborne.fluid.arrays import Integers
from flowborne.fluid.boundary import Boundaries, BoundaryInflow, BoundaryNoSlip
from flowborne.fluid.ghosts import edge, wall_velocity
from flowborne.fluid.grid import Array, Faces, Grid
from flowborne.fluid.jit import kernel
from flowborne.fluid.projection import OPEN, PERIODIC, side_codes

INACTIVE, UNKNOWN, GIVEN, TIED = range(4)
"""A face is inside a body, solved for, prescribed by a side, or moves with the body beside it."""

TOUCHING = 1e-3
"""Faces whose centres are not farther than this from a body move with it, cells."""

SIDE_MASS = 0.75
"""Part of the mass of the faces along a no-slip or inflow side that its friction slows down: what
lies nearer to them than to the side. With it a parabola is exact."""

OBLIQUE = 0.5
"""Least cosine between a wall's area and its normal: bounds x_w where the cells are too coarse."""


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


@kernel
def face_distances(distance: Array, axis: int, out: Array) -> None:
    """Distance to the nearest body at the centres of the faces across `axis`: mean of corners."""
    ai, aj = int(axis != 0), int(axis == 0)
    bj, bk = int(axis == 2), int(axis != 2)
    for i in prange(out.shape[0]):
        for j in range(out.shape[1]):
            for k in range(out.shape[2]):
                out[i, j, k] = 0.25 * (
                    distance[i, j, k]
                    + distance[i + ai, j + aj, k]
                    + distance[i, j + bj, k + bk]
                    + distance[i + ai, j + aj + bj, k + bk]
                )


@kernel
def classify(
    kind: NDArray[np.uint8],
    opened: Array,
    distance: Array,
    axis: int,
    codes: Integers,
    touching: float,
) -> None:
    """Kind of every face across `axis`; `distance` is at the faces."""
    last = kind.shape[axis] - 1
    for i in prange(kind.shape[0]):
        for j in range(kind.shape[1]):
            for k in range(kind.shape[2]):
                at = i if axis == 0 else (j if axis == 1 else k)
                kind[i, j, k] = UNKNOWN
                if opened[i, j, k] == 0.0:
                    kind[i, j, k] = INACTIVE
                elif (at == 0 and codes[axis, 0] == 0) or (at == last and codes[axis, 1] == 0):
                    kind[i, j, k] = GIVEN
                elif at == last and codes[axis, 1] == PERIODIC:
                    kind[i, j, k] = INACTIVE
                elif distance[i, j, k] <= touching:
                    kind[i, j, k] = TIED


@kernel
def aperture(
    opened: Array, across: Array, axis: int, d: int, i: int, j: int, k: int, last: int
) -> float:
    """Open part of the side between the control volume of a face and the next one along d.

    opened   open fractions of the faces across `axis`
    across   open fractions of the faces across d
    last     index of the last face across `axis`
    """
    ei, ej, ek = int(d == 0), int(d == 1), int(d == 2)
    if d == axis:
        return 0.5 * (opened[i, j, k] + opened[i + ei, j + ej, k + ek])
    at = i if axis == 0 else (j if axis == 1 else k)
    li, lj, lk = int(axis == 0), int(axis == 1), int(axis == 2)
    total, count = 0.0, 0
    if at > 0:
        total += across[i - li + ei, j - lj + ej, k - lk + ek]
        count += 1
    if at < last:
        total += across[i + ei, j + ej, k + ek]
        count += 1
    return total / count


@kernel
def following(at: int, count: int, periodic: bool) -> int:
    """Index after `at` among `count` distinct faces; -1 beyond the domain."""
    if at + 1 < count:
        return at + 1
    return 0 if periodic else -1


@kernel
def link_faces(
    axis: int,
    d: int,
    kind: NDArray[np.uint8],
    opened: Array,
    across: Array,
    velocity: Array,
    stiffness: float,
    diagonal: Array,
    link: Array,
    given: Array,
    periodic: bool,
) -> None:
    """Add the links along d to the system of the faces across `axis`.

    stiffness  mu A / h, kg/s
    periodic   whether the domain is along d
    """
    last = kind.shape[axis] - 1
    count = kind.shape[d] - int(periodic and d == axis)
    for i in range(kind.shape[0]):
        for j in range(kind.shape[1]):
            for k in range(kind.shape[2]):
                at = i if d == 0 else (j if d == 1 else k)
                to = following(at, count, periodic)
                if at >= count or to < 0:
                    continue
                g = to if d == 0 else i, to if d == 1 else j, to if d == 2 else k
                here, there = kind[i, j, k] == UNKNOWN, kind[g] == UNKNOWN
                known = kind[i, j, k] == GIVEN or kind[g] == GIVEN
                if not ((here and there) or (known and (here or there))):
                    continue
                coefficient = stiffness * aperture(opened, across, axis, d, i, j, k, last)
                if here:
                    diagonal[i, j, k] += coefficient
                if there:
                    diagonal[g] += coefficient
                if here and there:
                    link[i, j, k] = coefficient
                elif here:
                    given[i, j, k] += coefficient * velocity[g]
                else:
                    given[g] += coefficient * velocity[i, j, k]


@kernel
def meet_walls(
    axis: int,
    kind: NDArray[np.uint8],
    opened: Faces,
    phi: Array,
    stiffness: float,
    spacing: float,
    codes: Integers,
    beside: Integers,
    wall: Array,
    gap: Array,
) -> None:
    """Wall coefficient and x_f - x_w of the faces `beside`; both 0 where no link is cut.

    beside  (n,) flat indices of unknown faces across `axis`
    """
    last = kind.shape[axis] - 1
    area = np.zeros(3)
    for n in range(beside.size):
        f = beside[n]
        i = f // (kind.shape[1] * kind.shape[2])
        j, k = (f // kind.shape[2]) % kind.shape[1], f % kind.shape[2]
        slope = 0.0
        area[:] = 0.0
        for d in range(2 if opened[0].shape[2] == 1 else 3):
            periodic = codes[d, 0] == PERIODIC
            count = kind.shape[d] - int(periodic and d == axis)
            at = i if d == 0 else (j if d == 1 else k)
            for side in (-1, 1):
                to = at + side
                if to < 0 or to >= count:
                    if not periodic:
                        continue
                    to = (to + count) % count
                g = to if d == 0 else i, to if d == 1 else j, to if d == 2 else k
                link = 0.0
                if kind[g] == UNKNOWN or kind[g] == GIVEN:
                    low = g if side < 0 else (i, j, k)
                    link = stiffness * aperture(
                        opened[axis], opened[d], axis, d, low[0], low[1], low[2], last
                    )
                area[d] -= side * spacing * (stiffness - link)
                slope += link * (phi[g] - phi[i, j, k])
        size = np.sqrt((area**2).sum())
        if size > 0.0:
            wall[n] = max(slope, OBLIQUE * size) / phi[i, j, k]
            gap[n] = area / wall[n]


def assemble_viscosity(
    distance: Array,
    opened: Faces,
    velocity: Faces,
    grid: Grid,
    boundaries: Boundaries,
    density: float,
    viscosity: float,
    dt: float,
    time: float,
) -> list[ViscousFaces]:
    """The viscous system of each component.

    distance  (nx+1, ny+1, nz+1) to the nearest body at the nodes, m
    velocity  Faces; used where a side prescribes it
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
        mass = density * grid.cell_volume / dt * opened[axis]
        for end, layer in ((0, 0), (1, -1)):
            if codes[axis, end] == OPEN:
                mass[edge(axis, layer)] *= 0.5
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
