"""Between bodies and grid: the leak-proof field, fluxes, wrenches, momenta.

A body's twist holds the velocity (3) of its point at the world origin and its angular velocity (3).
The motion of everything (k,) holds all twists, then the velocity (3) of every vertex of flesh.
J v, the flux of moving bodies out of a cell (see `solve`), is  values @ motion  over the rows of
`Geometry`; J^T p is the transpose, a push (k,): wrenches, then forces on vertices. Motion and
generalised velocities are related by the Jacobians of the kinematics, T.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from flowborne.coupling.fractions import Geometry
from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.ghosts import edge
from flowborne.fluid.grid import Array, Faces, Grid
from flowborne.kernels.body_velocity import add_body_velocity
from flowborne.kernels.sparse_rows import add_rows, sum_rows
from flowborne.solids.dynamics import Kinematics


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
    bodies = kinematics.twist_jacobian.shape[0]
    on_bones = np.einsum("bwv,bw->v", kinematics.twist_jacobian, push[: 6 * bodies].reshape(-1, 6))
    if kinematics.vertices.size == 0:
        return np.asarray(on_bones)
    return np.asarray(on_bones + kinematics.vertex_jacobian.T @ push[6 * bodies :])


def on_bodies(kinematics: Kinematics, carried: Array, push: Array) -> Array:
    """(nbody, 6) wrench of a push (k,) on every body with the flesh that it carries.

    carried  (n, nbody) share of each body in a vertex, see `Flesh`
    """
    bodies = kinematics.twist_jacobian.shape[0]
    if kinematics.vertices.size == 0:
        return push.reshape(bodies, 6)
    force, place = push[6 * bodies :].reshape(-1, 3), kinematics.vertices
    wrench = np.concatenate([force, np.cross(place, force)], axis=1)
    return push[: 6 * bodies].reshape(-1, 6) + carried.T @ wrench


def leak_proof(velocity: Faces, geometry: Geometry, moving: Array, grid: Grid) -> Faces:
    """Field that crosses no body: open part fluid, closed part body.

    In place of the leak-proof projection of section 6, item 4: nothing is solved for.

    moving  (k,) see `motion`
    """
    first = moving.size - geometry.skins.vertices.size
    carried = [opened * u for opened, u in zip(geometry.open, velocity, strict=True)]
    for axis in grid.axes:
        add_body_velocity(
            carried[axis],
            axis,
            geometry.axis,
            geometry.face,
            geometry.body,
            geometry.closed,
            geometry.place,
            geometry.corner,
            geometry.weight,
            moving[:first].reshape(-1, 6),
            moving[first:].reshape(-1, 3),
        )
    return carried[0], carried[1], carried[2]


def add_flux(out: Array, geometry: Geometry, moving: Array) -> None:
    """Add the volume rate that the bodies' motion (k,) takes from each cell, J v, m^3/s."""
    g = geometry
    add_rows(out, (g.cells, g.row_start, g.columns, g.values), moving)


def pressure_push(geometry: Geometry, pressure: Array, size: int) -> Array:
    """(size,) J^T p of a pressure field (nx, ny, nz): wrenches about the world origin on bodies and
    forces on vertices of flesh, N and N m (impulses for p^ = p dt)."""
    g = geometry
    field = np.ascontiguousarray(pressure)
    return sum_rows(field, (g.cells, g.row_start, g.columns, g.values), size)


def buoyancy_wrench(centroid: Array, volume: Array, gravity: Array, density: float) -> Array:
    """(nbody, 6) Archimedes' force -rho g V at the centroid of each body's displaced volume."""
    force = -density * volume[:, None] * gravity[None, :]
    return np.concatenate([force, np.cross(centroid, force)], axis=1)


def side_push(pressure: Array, opened: Faces, grid: Grid, boundaries: Boundaries) -> Array:
    """(3,) force of the solid and inflow sides on the fluid for a pressure field, N.

    A cell that bodies and sides close in pushes nothing: the pressure it had before stays in it.

    opened  Faces, open part of each
    """
    force = np.zeros(3)
    for axis in grid.axes:
        for end, side in enumerate(boundaries.pair(axis)):
            if side.kind not in ("open", "periodic"):
                layer = edge(axis, slice(-1, None) if end else slice(1))
                met = pressure[layer] * beside_open(layer, opened, grid, boundaries)
                force[axis] += (1 - 2 * end) * grid.face_area * float(met.sum())
    return force


def beside_open(
    layer: tuple[int | slice, ...], opened: Faces, grid: Grid, boundaries: Boundaries
) -> NDArray[np.bool_]:
    """Which cells of a layer have an open face that is on no solid side."""
    count = np.zeros(grid.shape, np.int8)[layer]
    for axis in grid.axes:
        low, high = (side.kind in ("open", "periodic") for side in boundaries.pair(axis))
        free = (opened[axis] > 0.0).astype(np.int8)
        free[edge(axis, 0)] *= low
        free[edge(axis, -1)] *= high
        count += free[edge(axis, slice(-1))][layer] + free[edge(axis, slice(1, None))][layer]
    return np.asarray(count > 0)


def carried_in(
    velocity: Faces, opened: Faces, grid: Grid, boundaries: Boundaries, density: float
) -> Array:
    """(3,) momentum per time that the flow itself carries in through the sides, N."""
    inward = np.zeros(3)
    for flux, beside in through_sides(velocity, opened, grid, boundaries, density):
        for axis, (low, high) in beside.items():
            inward[axis] += float((flux * (0.5 * (low + high))).sum())
    return inward


def through_sides(
    velocity: Faces, opened: Faces, grid: Grid, boundaries: Boundaries, density: float
) -> Iterator[tuple[Array, dict[int, tuple[Array, Array]]]]:
    """What flows through each open or inflow side.

    yields  mass per time that comes in through every face of the side, kg/s, and for each axis the
            velocity along it at both edges of the face, m/s (across the side the face's own, twice)
    """
    for axis in grid.axes:
        for end, side in enumerate(boundaries.pair(axis)):
            if side.kind not in ("open", "inflow"):
                continue
            layer, sign = (-1, -1.0) if end else (0, 1.0)
            normal: Array = np.asarray(velocity[axis].take(layer, axis))
            flux = sign * density * grid.face_area * (normal * opened[axis].take(layer, axis))
            beside = {axis: (normal, normal)}
            for other in grid.axes:
                if other != axis:
                    tangential = velocity[other].take(layer, axis)
                    along = other - 1 if other > axis else other
                    beside[other] = (
                        np.delete(tangential, -1, along),
                        np.delete(tangential, 0, along),
                    )
            yield flux, beside
