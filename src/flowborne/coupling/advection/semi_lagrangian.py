"""The paper's own scheme: semi-Lagrangian along particle paths (see `fluid.advection`).

It loses momentum, and the report of a step says how much.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from flowborne.coupling.advection.scheme import Advection, AdvectionResult, Departure
from flowborne.coupling.mouths import add_closed_slip, fill_mouths, jet_force
from flowborne.coupling.operators import boundary_velocity, leak_proof
from flowborne.fluid.advection import OFFSETS, carry, cells_per_step
from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.ghosts import pad_faces
from flowborne.fluid.grid import Array, Faces, Grid, faces_of
from flowborne.fluid.momentum import face_masses, fluid_momentum
from flowborne.fluid.transport import Transport
from flowborne.solids.dynamics import kinematics


@dataclass(frozen=True)
class SemiLagrangian(Advection):
    """What arrives at a face has the velocity of the place that it comes from."""

    explicit_half_pressure = False

    def carry(self, start: Departure, velocity: Faces, transport: Transport) -> AdvectionResult:
        grid, sides, jets = start.grid, start.sides, start.jets
        density, before, end = start.density, transport.before, transport.after
        carried = faces_of([u.copy() for u in velocity])
        fill_mouths(carried, jets, grid)
        field, arrived = pad_faces(carried, grid, sides, transport.time), grid.zeros_faces()
        counts, periodic = np.array(grid.shape), np.array(sides.periodic(), np.uint8)
        paths = particle_paths(start, transport)
        for axis in grid.axes:
            carry(arrived[axis], field[axis], *paths, OFFSETS[axis], counts, periodic)
        end.follow(arrived, grid)
        was = fluid_momentum(velocity, face_masses(before, density), grid, sides)
        now = fluid_momentum(arrived, face_masses(end, density), grid, sides)
        crossed = transport.dt * carried_in(velocity, start.cut.open, grid, sides, density)
        expelled = transport.dt * jet_force(jets, density)
        lost = now - was - crossed - expelled
        return AdvectionResult(arrived, end, lost, crossed, np.zeros(3), expelled, jets)


def particle_paths(start: Departure, transport: Transport) -> Faces:
    """Padded Faces, cells per step, along which velocity goes: that of the fluid through the open
    and of the bodies through the closed part of each face."""
    grid, bodies = start.grid, start.bodies
    moving = boundary_velocity(kinematics(start.solid, bodies.q), bodies.v)
    pairs = zip(start.state.velocity, start.state.velocity_change, strict=True)
    ahead = faces_of([u + 0.5 * change for u, change in pairs])
    field = leak_proof(ahead, start.cut, moving, grid)
    add_closed_slip(field, start.jets, grid)
    padded = pad_faces(field, grid, start.sides, transport.time)
    return cells_per_step(padded, transport.dt, grid.spacing)


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
    """What flows through each side that fluid crosses.

    yields  mass per time that comes in through every face of the side, kg/s, and for each axis the
            velocity along it at both edges of the face, m/s (across the side the face's own, twice)
    """
    for place, side in boundaries.around(grid):
        if not (side.free or side.supplies):
            continue
        axis, (layer, sign) = place.axis, (-1, -1.0) if place.upper else (0, 1.0)
        normal: Array = np.asarray(velocity[axis].take(layer, axis))
        flux = sign * density * grid.face_area * (normal * opened[axis].take(layer, axis))
        beside = {axis: (normal, normal)}
        for other in grid.axes:
            if other != axis:
                tangential = velocity[other].take(layer, axis)
                along = other - 1 if other > axis else other
                beside[other] = np.delete(tangential, -1, along), np.delete(tangential, 0, along)
        yield flux, beside
