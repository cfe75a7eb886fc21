"""Between bodies and grid: the leak-proof field, fluxes, wrenches, momenta.

A body's twist holds the velocity (3) of its point at the world origin and its angular velocity (3).
The motion of everything (k,) holds all twists, then the velocity (3) of every vertex of flesh.
J v, the flux of moving bodies out of a cell (see `solve`), is  values @ motion  over the rows of
`Geometry`; J^T p is the transpose, a push (k,): wrenches, then forces on vertices. Motion and
generalised velocities are related by the Jacobians of the kinematics, T.
"""

from __future__ import annotations

import numpy as np

from flowborne.coupling.fractions import Geometry
from flowborne.fluid.dipoles import Dipoles
from flowborne.fluid.grid import Grid, faces_of
from flowborne.fluid.projection import PressureGradient
from flowborne.kernels.arrays import FREE, Array, DenseTerm, Faces
from flowborne.kernels.coupling_rows import Motion, add_body_velocity
from flowborne.kernels.momentum import about_origin
from flowborne.kernels.sparse_rows import add_rows, sum_rows
from flowborne.solids.dynamics import Kinematics
from flowborne.solvers.pressure import NO_DENSE_TERM


def twists(kinematics: Kinematics, v: Array) -> Array:
    """(nbody, 6) twist of every body at generalised velocity v (nv,)."""
    return kinematics.twist_jacobian @ v


def boundary_velocity(kinematics: Kinematics, v: Array) -> Array:
    """(k,) twist of every body, then velocity of every vertex of flesh."""
    bones = twists(kinematics, v).ravel()
    if kinematics.vertices.size == 0:
        return bones
    return np.append(bones, kinematics.vertex_jacobian @ v)


def generalised(kinematics: Kinematics, push: Array) -> Array:
    """(nv,) generalised force of a push (k,): wrench on every body, then force on every vertex."""
    if kinematics.vertices.size == 0:
        wrenches = push.reshape(-1, 6)
        return np.asarray(np.einsum("bwv,bw->v", kinematics.twist_jacobian, wrenches))
    first = push.size - kinematics.vertices.size
    from_bones, from_vertices = kinematics.transposed
    return np.asarray(from_bones @ push[:first] + from_vertices @ push[first:])


def leak_proof(velocity: Faces, geometry: Geometry, moving: Array, grid: Grid) -> Faces:
    """Field that crosses no body: open part fluid, closed part body.

    In place of the leak-proof projection of section 6, item 4: nothing is solved for.

    moving  (k,) see `motion`
    """
    fields = [carried(axis, velocity, geometry, moving) for axis in grid.axes]
    return faces_of([*fields, *velocity[len(fields) :]])


def carried(axis: int, velocity: Faces, geometry: Geometry, moving: Array) -> Array:
    """Its component along an axis."""
    field = geometry.open[axis] * velocity[axis]
    add_body_velocity(field, axis, geometry.closed, motion_of(geometry, moving))
    return field


def motion_of(geometry: Geometry, moving: Array) -> Motion:
    """The motion (k,) as kernels take it."""
    first = moving.size - geometry.skins.vertices.size
    return moving[:first].reshape(-1, 6), moving[first:].reshape(-1, 3)


def add_flux(out: Array, geometry: Geometry, moving: Array) -> None:
    """Add the volume rate that the bodies' motion (k,) takes from each cell, J v, m^3/s."""
    add_rows(out, geometry.rows, moving)


def pressure_push(geometry: Geometry, pressure: Array, size: int) -> Array:
    """(size,) J^T p of a pressure field (nx, ny, nz): wrenches about the world origin on bodies and
    forces on vertices of flesh, N and N m (impulses for p^ = p dt)."""
    return sum_rows(np.ascontiguousarray(pressure), geometry.rows, size)


def buoyancy_wrench(centroid: Array, volume: Array, gravity: Array, density: float) -> Array:
    """(nbody, 6) Archimedes' force -rho g V at the centroid of each body's displaced volume."""
    force = -density * volume[:, None] * gravity[None, :]
    return about_origin(force, np.zeros(force.shape), centroid)


def beyond_sides(dipoles: Dipoles | None, strength: float) -> DenseTerm:
    """What the matrix of the pressure has besides its face weights.

    strength  flux through an uncut face on a side with unit pressure in its cell and 0 on the side
    """
    if dipoles is None:
        return NO_DENSE_TERM
    return dipoles.cells, dipoles.vectors, strength * dipoles.signs


def side_push(pressure: Array, opened: Faces, gradient: PressureGradient) -> Array:
    """(3,) force of the sides on the fluid for a pressure field, N.

    pressure  (nx, ny, nz) Pa, 0 in cells that bodies and sides close in
    opened    Faces, open part of each
    """
    grid, boundaries, force = gradient.grid, gradient.boundaries, np.zeros(3)
    for place, answer in gradient.dipoles.answer(pressure) if gradient.dipoles else ():
        force[place.axis] -= (1 - 2 * place.upper) * grid.face_area * float(answer.sum())
    for place, side in boundaries.around(grid):
        met = pressure[place.layer] * (1.0 - side.pressure_weight(place))
        if side.normal == FREE:
            met *= opened[place.axis][place.layer]
        force[place.axis] += (1 - 2 * place.upper) * grid.face_area * float(met.sum())
    return force
