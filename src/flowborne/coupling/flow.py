"""What a step does to the fluid before and after the coupled solve, named as in `step`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne.coupling.cut import Departure
from flowborne.coupling.fractions import Geometry
from flowborne.coupling.half_pressure import HalfPressure
from flowborne.coupling.leak_proof import leak_proof_flux
from flowborne.coupling.mouths import (
    Jet,
    after_drinking,
    brought_by,
    cells_with_inlets,
    inlets_across,
    taken_by,
)
from flowborne.coupling.operators import boundary_velocity, motion_of
from flowborne.coupling.solve import SolvedFlow
from flowborne.coupling.thrusters import Disc, push_water
from flowborne.coupling.world import Fluid, World
from flowborne.fluid.boundary import cells_in
from flowborne.fluid.control_volumes import ControlVolumes, control_volumes
from flowborne.fluid.dye import Dyed, Passage, carry_dye
from flowborne.fluid.ghosts import impose_sides, join_ends
from flowborne.fluid.grid import faces_of
from flowborne.fluid.projection import accelerated
from flowborne.fluid.transport import Transport, carry_component, damp_eddies
from flowborne.kernels.arrays import Array, Faces
from flowborne.kernels.control_volumes import stride
from flowborne.kernels.coupling_rows import fill_empty_faces
from flowborne.kernels.faces import changes_of_step, still_to_come
from flowborne.solids.dynamics import Kinematics


@dataclass(frozen=True)
class AdvectionResult:
    """The fluid after advection.

    velocity  Faces u*, m/s
    volumes   control volumes at the end of the step
    crossed   (3,) momentum that the flow carried in through the sides, N s
    stopped   (3,) momentum that sides with a prescribed velocity gave to the flow, N s; not what
              they did at the end without balances
    expelled  (3,) momentum that came in through mouths and sources, N s
    jets      of the mouths; those that take fluid in have the velocity of that fluid
    """

    velocity: Faces
    volumes: ControlVolumes
    crossed: Array
    stopped: Array
    expelled: Array
    jets: tuple[Jet, ...]


def leak_proof_transport(world: World, start: Departure, end: Geometry, dt: float) -> Transport:
    """Fluxes past the moving bodies, and the control volumes that they lead to at the cut `end`."""
    if end is not start.cut:
        world.pressed = None
    flux, cells = leak_proof_flux(world, start, end, dt)
    volumes = start.volumes
    if cells is not volumes.cells:
        volumes = control_volumes(cells, end.open, start.fluid.grid, start.fluid.boundaries)
    return Transport(flux, start.volumes, volumes, dt, world.time)


def advect(
    world: World, start: Departure, velocity: Faces, transport: Transport
) -> tuple[AdvectionResult, Dyed]:
    """Velocity and scalars a step later; `velocity` (Faces, m/s) is that at the start."""
    fluid, state = world.flow()
    carried = advect_momentum(start, velocity, transport, world.setup.balances)
    dyed = Dyed({}, 0.0)
    if state.scalars:
        inflow = brought_by(start.jets, start.rate, tuple(state.scalars))
        backwards = world.steps % 2 == 1
        passage = Passage(transport, inflow, fluid.grid, fluid.boundaries, backwards)
        dyed = carry_dye(state.scalars, passage, fluid.sources)
    return carried, dyed


def advect_momentum(
    start: Departure, velocity: Faces, transport: Transport, balances: bool
) -> AdvectionResult:
    """Every component on its moving control volumes; nothing is lost (see `fluid.transport`).

    velocity   Faces at the start, with half of the last pressure, m/s
    transport  leak-proof fluxes, and the control volumes at both ends of the step
    """
    fluid, state, jets = start.fluid, start.state, start.jets
    grid, sides = fluid.grid, fluid.boundaries
    dt, arrived = transport.dt, [np.zeros(u.shape) for u in velocity[len(grid.axes) :]]
    crossed, stopped, gained = np.zeros((3, 3))
    drunk = [np.zeros(3) for _ in jets]
    cells = cells_with_inlets(jets, start.sources, fluid.sources, grid)
    for axis in grid.axes:
        inlets = inlets_across(axis, cells, jets, start.sources, grid, sides)
        along, was = state.acceleration[axis], state.velocity[axis]
        if velocity[axis] is not was:
            along = np.empty(was.shape)
            still_to_come(along, state.acceleration[axis], velocity[axis], was, dt)
        carried = carry_component(velocity[axis], along, axis, transport, inlets, grid, sides)
        arrived.insert(axis, carried.velocity)
        crossed[axis] = fluid.density * carried.crossed
        stopped[axis] = fluid.density * carried.held
        if cells.size:
            brought = dt * float(inlets.gain @ inlets.velocity)
            gained[axis] = fluid.density * (brought - float(carried.drained.sum()))
        for jet, taken in zip(jets, drunk, strict=True):
            taken[axis] = taken_by(jet, axis, inlets, carried.drained, grid, sides)
    if fluid.viscosity == 0.0:
        damp_eddies(faces_of(arrived), transport, grid, sides)
    reached = faces_of(arrived)
    for place, across in sides.across(grid, transport.time + dt):
        u = reached[place.axis][place.layer]
        if balances:
            mass = fluid.density * transport.after.moving[place.axis][place.layer]
            stopped[place.axis] += float((mass * (across - u)).sum())
        u[:] = across
    join_ends(reached, grid, sides)
    return AdvectionResult(
        reached,
        transport.after,
        crossed,
        stopped,
        gained,
        tuple(after_drinking(jet, taken, dt) for jet, taken in zip(jets, drunk, strict=True)),
    )


def apply_forces_and_sides(
    advected: AdvectionResult,
    opened: Faces,
    fluid: Fluid,
    discs: tuple[Disc, ...],
    time: float,
    dt: float,
) -> Faces:
    """u*: velocity with the body force, thrusters, driven regions and prescribed sides.

    A body force acts like the pressure that balances it, on the open part of a face.

    time  s at the end of the step
    """
    grid, density = fluid.grid, fluid.density
    sources = [(s, s.velocity) for s in fluid.sources if s.active(time)]
    driven = [(cells_in(s, grid), u) for s, u in sources if u is not None]
    if not (driven or discs or any(fluid.body_force)):
        return advected.velocity
    velocity = faces_of([u.copy() for u in advected.velocity])
    if any(fluid.body_force):
        rates = accelerated(opened, advected.volumes.moving, density, grid, fluid.boundaries)
        for axis in grid.axes:
            velocity[axis][:] += dt * density * fluid.body_force[axis] * grid.spacing * rates[axis]
    push_water(velocity, discs, advected.volumes, density, dt)
    for axis in grid.axes:
        for cells, driven_velocity in driven:
            box = list(cells)
            box[axis] = slice(box[axis].start, box[axis].stop + 1)
            velocity[axis][tuple(box)] = driven_velocity[axis]
    impose_sides(velocity, grid, fluid.boundaries, time)
    return velocity


def store_state(
    world: World,
    start: Departure,
    half: HalfPressure,
    advected: AdvectionResult,
    dyed: Dyed,
    solved: SolvedFlow,
    cut: Geometry,
    pose: Kinematics,
) -> None:
    """The state at the end of the step, in place: what was solved for, and what the step changed;
    on faces that bodies cut only where they stand in a trial.

    Faces without fluid have the velocity of the leak-proof field; `solved.velocity` gets
    it too, and becomes the state's own. Cells that the solve leaves out have no pressure: no fluid
    would give what half of their last one gave to bodies.
    """
    fluid, state = world.flow()
    grid, sides, volumes = fluid.grid, fluid.boundaries, advected.volumes
    dt, velocity = solved.driven.system.dt, solved.velocity
    stands = world.setup.trial and cut is start.cut
    world.solid.v[:], world.volumes = solved.v, (cut, volumes)
    fill_with_leak_proof(velocity, volumes, cut, boundary_velocity(pose, solved.v), fluid)
    volumes.follow(velocity, grid)
    for axis in grid.axes:
        change, acceleration = state.velocity[axis], state.acceleration[axis]
        passed = half.velocity[axis], advected.velocity[axis]
        changes_of_step(acceleration, change, velocity[axis], *passed, dt)
        for values in (acceleration,) if stands else (acceleration, change):
            values.reshape(-1)[volumes.cut[axis]] = 0.0
    for field in (state.acceleration, state.velocity):
        join_ends(field, grid, sides)
    state.previous_pressure, state.pressure = state.pressure, solved.pressure
    if half.velocity is not state.velocity:  # else none acted
        left_out = solved.pressure == 0.0
        state.previous_pressure = state.previous_pressure + half.pressure
        state.pressure = np.where(left_out, 0.0, half.pressure + solved.pressure)
    state.velocity, state.velocity_change = velocity, state.velocity
    state.cell_volume, state.pose = volumes.cells, world.solid.q.copy()
    state.scalars = dyed.scalars
    world.advance_clock(dt)


def fill_with_leak_proof(
    velocity: Faces, volumes: ControlVolumes, cut: Geometry, moving: Array, fluid: Fluid
) -> None:
    """Give faces that no fluid moves with the velocity of the leak-proof field, in place.

    moving  (k,) see `operators.leak_proof`
    """
    grid, sides, motion = fluid.grid, fluid.boundaries, motion_of(cut, moving)
    for axis in grid.axes:
        faces = np.concatenate([volumes.cut[axis], volumes.closed[axis].faces])
        if sides.periodic()[axis]:  # the last ones are the first ones
            shape = grid.face_shape(axis)
            first = faces[np.unravel_index(faces, shape)[axis] == 0]
            faces = np.append(faces, first + grid.shape[axis] * stride(shape, axis))
        held, opened = volumes.moving[axis], cut.open[axis]
        fill_empty_faces(faces, velocity[axis], axis, held, opened, cut.closed, motion)
