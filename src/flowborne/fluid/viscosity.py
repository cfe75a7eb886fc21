"""Implicit viscosity on cut cells, with no-slip bodies that may move freely.

Finite volumes around every face: with mass m = a rho V, links k = mu A_open / h between
neighbours, and a wall coefficient W where a body is beside the face,

    m (u+ - u*) / dt = sum_g k (u_g - u_f) - W (u_f - b_f) - sum_g k (b_g - b_f)

b is the body's own rigid velocity at the face. W = sum_g k (d_g - d_f) / d_f with the distance d
to the wall makes a linear shear exact; the last sum, over the same links as the first, makes a
rigid rotation of body and fluid together exact. What the wall term takes from the fluid it gives
to the body, and that is the whole moment of the stress mu (grad u + grad u^T): on a no-slip wall
the part of the rotation itself cancels between the two gradients. Bodies enter through their
six-component velocity s = s* + M (impulse), so the system for u alone stays symmetric positive
definite with a low-rank term (Robinson-Mosher, Schroeder and Fedkiw 2011 do the same by hand).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flowborne.fluid.boundary import Boundaries, BoundaryInflow, BoundaryNoSlip
from flowborne.fluid.ghosts import edge, wall_velocity
from flowborne.fluid.grid import Array, Faces, Grid
from flowborne.fluid.jit import kernel
from flowborne.fluid.projection import OPEN, PERIODIC, side_codes

Integers = NDArray[np.int64]

INACTIVE, UNKNOWN, GIVEN, TIED = range(4)
"""A face is inside a body, solved for, prescribed by a side, or moves with the body beside it."""


@dataclass
class ViscousFaces:
    """The viscous system of the faces across one axis; arrays have the shape of the faces.

    kind      INACTIVE, UNKNOWN, GIVEN or TIED
    mass      m / dt, kg/s
    diagonal  m / dt + sum of links + W, kg/s
    links     (3, ...) k to the next face along each axis, between unknowns, kg/s
    given     force of neighbours and sides with prescribed velocity, N
    wall      W, kg/s
    turning   (..., 3) sum_g k (b_g - b_f) for unit rotation about x, y, z, kg m/s
    """

    kind: NDArray[np.uint8]
    mass: Array
    diagonal: Array
    links: Array
    given: Array
    wall: Array
    turning: Array


@kernel
def centre_distance(distance: Array, axis: int, i: int, j: int, k: int) -> float:
    """Distance to the nearest body at the centre of a face: mean of its corners."""
    dj, dk = (1, 1) if axis == 0 else ((0, 1) if axis == 1 else (1, 0))
    di = 0 if axis == 0 else 1
    if axis == 0:
        return 0.25 * (
            distance[i, j, k]
            + distance[i, j + dj, k]
            + distance[i, j, k + dk]
            + distance[i, j + dj, k + dk]
        )
    return 0.25 * (
        distance[i, j, k]
        + distance[i + di, j, k]
        + distance[i, j + dj, k + dk]
        + distance[i + di, j + dj, k + dk]
    )


@kernel
def face_distances(distance: Array, axis: int, out: Array) -> None:
    """Distance at the centres of all faces across `axis`."""
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            for k in range(out.shape[2]):
                out[i, j, k] = centre_distance(distance, axis, i, j, k)


@kernel
def classify(
    kind: NDArray[np.uint8], opened: Array, distance: Array, axis: int, codes: Integers
) -> None:
    """Kind of every face across `axis`; `distance` is at the faces."""
    last = kind.shape[axis] - 1
    for i in range(kind.shape[0]):
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
                elif distance[i, j, k] <= 0.0:
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
def link_faces(
    axis: int,
    d: int,
    kind: NDArray[np.uint8],
    opened: Array,
    across: Array,
    phi: Array,
    velocity: Array,
    stiffness: float,
    spacing: float,
    slope: Array,
    diagonal: Array,
    link: Array,
    given: Array,
    turning: Array,
    codes: Integers,
) -> None:
    """Add the links along d to the system of the faces across `axis`.

    stiffness  mu A / h, kg/s;  slope  gathers sum_g k (d_g - d_f)
    """
    ni, nj, nk = kind.shape
    ei, ej, ek = int(d == 0), int(d == 1), int(d == 2)
    last = kind.shape[axis] - 1
    periodic = codes[d, 0] == PERIODIC
    ahead = kind.shape[d] - 1 if d == axis else kind.shape[d]
    wrap_axis = codes[axis, 0] == PERIODIC
    for i in range(ni):
        for j in range(nj):
            for k in range(nk):
                at = i if d == 0 else (j if d == 1 else k)
                gi, gj, gk = i + ei, j + ej, k + ek
                if at == ahead - 1 and periodic:
                    gi, gj, gk = (
                        i - ei * (ahead - 1),
                        j - ej * (ahead - 1),
                        k - ek * (ahead - 1),
                    )
                elif gi >= ni or gj >= nj or gk >= nk:
                    continue
                if d == axis and wrap_axis and at >= ahead:
                    continue
                f, g = kind[i, j, k], kind[gi, gj, gk]
                if f in (INACTIVE, TIED) or g in (INACTIVE, TIED):
                    continue
                if f == GIVEN and g == GIVEN:
                    continue
                coefficient = stiffness * aperture(opened, across, axis, d, i, j, k, last)
                rise = phi[gi, gj, gk] - phi[i, j, k]
                if f == UNKNOWN:
                    diagonal[i, j, k] += coefficient
                    slope[i, j, k] += coefficient * rise
                    turn(turning, i, j, k, axis, d, coefficient * spacing)
                if g == UNKNOWN:
                    diagonal[gi, gj, gk] += coefficient
                    slope[gi, gj, gk] -= coefficient * rise
                    turn(turning, gi, gj, gk, axis, d, -coefficient * spacing)
                if f == UNKNOWN and g == UNKNOWN:
                    link[i, j, k] = coefficient
                elif f == UNKNOWN:
                    given[i, j, k] += coefficient * velocity[gi, gj, gk]
                else:
                    given[gi, gj, gk] += coefficient * velocity[i, j, k]


@kernel
def turn(turning: Array, i: int, j: int, k: int, axis: int, d: int, step: float) -> None:
    """Add what a step along d changes in component `axis` of a unit rotation about each axis."""
    if axis == 0:
        if d == 2:
            turning[i, j, k, 1] += step
        elif d == 1:
            turning[i, j, k, 2] -= step
    elif axis == 1:
        if d == 2:
            turning[i, j, k, 0] -= step
        elif d == 0:
            turning[i, j, k, 2] += step
    elif d == 1:
        turning[i, j, k, 0] += step
    elif d == 0:
        turning[i, j, k, 1] -= step


@kernel
def finish_walls(
    kind: NDArray[np.uint8],
    phi: Array,
    slope: Array,
    wall: Array,
    diagonal: Array,
    turning: Array,
    near: float,
) -> None:
    """Wall coefficients from slopes, where a body is within `near`; elsewhere no turning."""
    for i in range(kind.shape[0]):
        for j in range(kind.shape[1]):
            for k in range(kind.shape[2]):
                beside = kind[i, j, k] == UNKNOWN and phi[i, j, k] < near
                if beside and slope[i, j, k] > 0.0:
                    wall[i, j, k] = slope[i, j, k] / phi[i, j, k]
                    diagonal[i, j, k] += wall[i, j, k]
                if not beside:
                    turning[i, j, k, :] = 0.0


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
    stiffness = viscosity * grid.face_area / grid.spacing
    systems = []
    for axis in grid.axes:
        shape = grid.face_shape(axis)
        kind = np.empty(shape, np.uint8)
        phi = np.empty(shape)
        face_distances(distance, axis, phi)
        classify(kind, opened[axis], phi, axis, codes)
        mass = density * grid.cell_volume / dt * opened[axis]
        for end, layer in ((0, 0), (1, -1)):
            if codes[axis, end] == OPEN:
                mass[edge(axis, layer)] *= 0.5
        system = ViscousFaces(
            kind,
            mass,
            mass.copy(),
            np.zeros((3, *shape)),
            np.zeros(shape),
            np.zeros(shape),
            np.zeros((*shape, 3)),
        )
        slope = np.zeros(shape)
        for d in grid.axes:
            link_faces(
                axis,
                d,
                kind,
                opened[axis],
                opened[d],
                phi,
                velocity[axis],
                stiffness,
                grid.spacing,
                slope,
                system.diagonal,
                system.links[d],
                system.given,
                system.turning,
                codes,
            )
            if d != axis:
                for end, side in enumerate(boundaries.pair(d)):
                    if isinstance(side, (BoundaryInflow, BoundaryNoSlip)):
                        layer_index = edge(d, -1 if end else 0)
                        wall = wall_velocity(side, grid, d, bool(end), axis, time)
                        if isinstance(wall, np.ndarray):
                            wall = wall[edge(d, 0)]
                        unknown = kind[layer_index] == UNKNOWN
                        coefficient = 2.0 * stiffness * unknown
                        system.diagonal[layer_index] += coefficient
                        system.given[layer_index] += coefficient * wall
        finish_walls(
            kind, phi, slope, system.wall, system.diagonal, system.turning, 2.0 * grid.spacing
        )
        systems.append(system)
    return systems
