"""What a step does to the fluid before and after the coupled solve, named as in `step`."""

from __future__ import annotations

import numpy as np

from flowborne.coupling.advection.scheme import AdvectionResult, Departure
from flowborne.coupling.fractions import Geometry
from flowborne.coupling.half_pressure import HalfPressure
from flowborne.coupling.inlets import brought_by
from flowborne.coupling.leak_proof import leak_proof_flux
from flowborne.coupling.operators import boundary_velocity, leak_proof
from flowborne.coupling.solve import Solved
from flowborne.coupling.world import Fluid, World
from flowborne.fluid.boundary import cells_in
from flowborne.fluid.control_volumes import control_volumes
from flowborne.fluid.dye import Dyed, Passage, carry_dye
from flowborne.fluid.ghosts import edge, impose_sides
from flowborne.fluid.grid import Faces, faces_of
from flowborne.fluid.projection import accelerated
from flowborne.fluid.transport import Transport
from flowborne.kernels.faces import changes_of_step, fill_empty_faces
from flowborne.solids.dynamics import Kinematics


def leak_proof_transport(world: World, start: Departure, end: Geometry, dt: float) -> Transport:
    """Fluxes past the moving bodies, and the control volumes that they lead to at the cut `end`."""
    flux, cells = leak_proof_flux(start, end, world.time + 0.5 * dt, dt)
    volumes = control_volumes(cells, end.open, start.grid, start.sides)
    return Transport(flux, start.volumes, volumes, dt, world.time)


def advect(
    world: World, start: Departure, velocity: Faces, transport: Transport
) -> tuple[AdvectionResult, Dyed]:
    """Velocity and scalars a step later; `velocity` (Faces, m/s) is that at the start."""
    fluid, state = world.flow()
    dyed = Dyed({}, 0.0)
    if state.scalars:
        inflow = brought_by(start.jets, start.rate, tuple(state.scalars))
        passage = Passage(transport, inflow, start.grid, start.sides, world.steps % 2 == 1)
        dyed = carry_dye(state.scalars, passage, fluid.sources)
    return fluid.advection.carry(start, velocity, transport), dyed


def apply_body_force_and_sides(
    advected: Faces, opened: Faces, mass: Faces, fluid: Fluid, time: float, dt: float
) -> Faces:
    """u*: velocity with the body force, driven regions and prescribed sides.

    A body force acts like the pressure that balances it, on the open part of a face.

    time  s at the end of the step
    """
    grid = fluid.grid
    velocity = faces_of([u.copy() for u in advected])
    if any(fluid.body_force):
        rates = accelerated(opened, mass, grid, fluid.boundaries)
        for axis in grid.axes:
            given = dt * fluid.density * fluid.body_force[axis] * grid.spacing
            velocity[axis][:] += given * rates[axis]
    for axis in grid.axes:
        for source in fluid.sources:
            if source.velocity is not None and source.active(time):
                box = list(cells_in(source, grid))
                box[axis] = slice(box[axis].start, box[axis].stop + 1)
                velocity[axis][tuple(box)] = source.velocity[axis]
    impose_sides(velocity, grid, fluid.boundaries, time)
    return velocity


def store_state(
    world: World,
    half: HalfPressure,
    advected: AdvectionResult,
    dyed: Dyed,
    solved: Solved,
    cut: Geometry,
    pose: Kinematics,
) -> None:
    """The state at the end of the step, in place: what was solved for, and what the step changed.

    Faces without fluid have the velocity of the leak-proof field; `solved.projected.velocity` gets
    it too, and becomes the state's own. Cells that the solve leaves out have no pressure: no fluid
    would give what half of their last one gave to bodies.
    """
    fluid, state = world.flow()
    grid, sides, volumes = fluid.grid, fluid.boundaries, advected.volumes
    dt, projected = solved.driven.system.dt, solved.projected
    assert projected is not None
    world.solid.v[:], world.volumes = solved.v, (cut, volumes)
    velocity = projected.velocity
    inside = leak_proof(velocity, cut, boundary_velocity(pose, solved.v), grid)
    for axis in grid.axes:
        fill_empty_faces(velocity[axis], volumes.moving[axis], inside[axis])
    volumes.follow(velocity, grid)
    for axis in grid.axes:
        change, acceleration = state.velocity[axis], state.acceleration[axis]
        passed = half.velocity[axis], advected.velocity[axis]
        changes_of_step(acceleration, change, velocity[axis], *passed, dt)
        for values in (change, acceleration):
            values.reshape(-1)[volumes.cut[axis]] = 0.0
            if sides.periodic()[axis]:
                values[edge(axis, -1)] = values[edge(axis, 0)]
    state.velocity, state.velocity_change = velocity, state.velocity
    state.previous_pressure = state.pressure + half.pressure
    left_out = projected.pressure == 0.0
    state.pressure = np.where(left_out, 0.0, half.pressure + projected.pressure)
    state.cell_volume, state.pose = volumes.cells, world.solid.q.copy()
    state.scalars = dyed.scalars
    world.advance_clock(dt)
