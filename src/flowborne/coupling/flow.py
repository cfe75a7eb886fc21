"""The fluid's half of a step: what happens to it between two coupled solves (paper, section 6).

Deviations from the paper: momentum is carried in flux form in place of along particle paths, which
lose a tenth of what a swimmer exchanges; and the field that carries it is that of the middle of the
step, from the last two velocities, in place of a solve of its own. The paper's own scheme is an
option: `Fluid.advection`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne.coupling.fractions import Geometry
from flowborne.coupling.inlets import after_drinking, brought_by, inlets_across, taken_by
from flowborne.coupling.leak_proof import leak_proof_flux
from flowborne.coupling.mouths import (
    Jet,
    add_closed_slip,
    add_rates,
    fill_mouths,
    jet_force,
)
from flowborne.coupling.operators import boundary_velocity, carried_in, leak_proof
from flowborne.coupling.world import Fluid, World
from flowborne.fluid.advection import OFFSETS, carry, cells_per_step
from flowborne.fluid.boundary import Boundaries, cells_in
from flowborne.fluid.control_volumes import ControlVolumes, control_volumes, parts
from flowborne.fluid.dye import Dyed, Passage, carry_dye
from flowborne.fluid.ghosts import edge, impose_sides, pad_faces
from flowborne.fluid.grid import Array, Faces, Grid, faces_of, inner_product
from flowborne.fluid.projection import accelerated
from flowborne.fluid.transport import Transport, beside_faces, carry_component
from flowborne.kernels.faces import (
    fill_empty_faces,
    gained,
    move_on,
    still_to_come,
    weighted_change,
)
from flowborne.solids.dynamics import kinematics


@dataclass(frozen=True)
class Carried:
    """What advection gave.

    velocity  Faces u*, m/s
    dyed      the scalars
    volumes   control volumes at the end of the step
    lost      (3,) momentum that advection made (or lost, when negative), N s; none in flux form
    crossed   (3,) momentum that the flow carried in through the sides, N s
    stopped   (3,) momentum that the sides which prescribe a velocity gave to what reached them, N s
    expelled  (3,) momentum that came in through mouths and sources, N s
    jets      of the mouths, those that drink with the velocity of what they drank
    """

    velocity: Faces
    dyed: Dyed
    volumes: ControlVolumes
    lost: Array
    crossed: Array
    stopped: Array
    expelled: Array
    jets: tuple[Jet, ...]


def volumes_of(world: World, cut: Geometry) -> ControlVolumes:
    """The control volumes of the fluid as it stands: those that the last step left in the cells, or
    those of the cut where the bodies have been put elsewhere since."""
    fluid, state = world.flow()
    cells = cut.volume if moved_since(world) else state.cells
    return control_volumes(cells, cut.open, fluid.grid, fluid.boundaries)


def moved_since(world: World) -> bool:
    """Whether the bodies have been put elsewhere since the last step, or there was none."""
    _, state = world.flow()
    return state.cells.size == 0 or not np.array_equal(state.pose, world.solid.q)


def face_masses(volumes: ControlVolumes, density: float) -> Faces:
    """Mass of the fluid that pressure on each face accelerates, kg; 0 at small ones."""
    return faces_of([density * v for v in volumes.merged])


def fluid_momentum(velocity: Faces, mass: Faces, grid: Grid, sides: Boundaries) -> Array:
    """(3,) linear momentum of the fluid, N s."""
    total = np.zeros(3)
    for axis in grid.axes:
        own = edge(axis, slice(None, -1 if sides.periodic()[axis] else None))
        total[axis] = inner_product(mass[axis][own], velocity[axis][own])
    return total


def momentum_change(
    before: Faces, after: Faces, mass: Faces, grid: Grid, sides: Boundaries
) -> tuple[Array, float]:
    """(3,) what linear momentum changes by between two velocities, and the sum of its parts' sizes,
    N s."""
    total, size = np.zeros(3), 0.0
    for axis in grid.axes:
        own = edge(axis, slice(None, -1 if sides.periodic()[axis] else None))
        fields = (np.ascontiguousarray(f[axis][own]) for f in (mass, before, after))
        total[axis], change = weighted_change(*fields)
        size += change
    return total, size


def kinetic_energy(velocity: Faces, mass: Faces, grid: Grid, sides: Boundaries) -> float:
    """Kinetic energy of the fluid, J."""
    squares = faces_of([0.5 * u * u for u in velocity])
    return float(fluid_momentum(squares, mass, grid, sides).sum())


def carry_fluid(
    world: World,
    velocity: Faces,
    q: Array,
    before: Geometry,
    start: ControlVolumes,
    after: Geometry,
    jets: tuple[Jet, ...],
    dt: float,
) -> Carried:
    """Velocity and scalars a step later, carried by the leak-proof field.

    velocity       Faces at its start, m/s
    q              (nq,) positions of the bodies at its start
    before, after  the cut grid at both ends of the step
    start          control volumes at its start
    jets           of the mouths before the step
    """
    fluid, state = world.flow()
    sides = fluid.boundaries
    sources = source_rate(fluid, world.time, before.open)
    rate = sources.copy()
    add_rates(rate, jets)
    middle = world.time + 0.5 * dt
    flux, cells = leak_proof_flux(
        state.advecting_velocity, before, after, start.cells, rate, fluid, middle, dt
    )
    end = control_volumes(cells, after.open, fluid.grid, sides)
    held = fluid.viscosity / fluid.density
    transport = Transport(flux, start, end, dt, world.time, held)
    dyed = Dyed({}, 0.0)
    if state.scalars:
        brought = brought_by(jets, rate, tuple(state.scalars))
        passage = Passage(transport, brought, fluid.grid, sides, world.steps % 2 == 1)
        dyed = carry_dye(state.scalars, passage, fluid.sources)
    if fluid.advection == "semi-lagrangian":
        paths = particle_paths(world, q, before, jets, dt)
        return carry_along_paths(world, before, transport, paths, dyed, jets)
    return carry_in_flux_form(world, velocity, transport, sources, dyed, jets)


def carry_in_flux_form(
    world: World,
    velocity: Faces,
    transport: Transport,
    sources: Array,
    dyed: Dyed,
    jets: tuple[Jet, ...],
) -> Carried:
    """Velocity a step later, on moving control volumes (see `transport`).

    velocity Faces at the start, m/s
    sources  (nx, ny, nz) what they bring into each cell, m^3/s
    dyed     the scalars a step later
    """
    fluid, state = world.flow()
    grid, sides, dt = fluid.grid, fluid.boundaries, transport.dt
    arrived, crossed, held, gained = grid.zeros_faces(), np.zeros(3), np.zeros(3), np.zeros(3)
    drunk = [np.zeros(3) for _ in jets]
    lasting = transport.lasting(grid)
    for axis in grid.axes:
        inlets = inlets_across(axis, jets, sources, grid, sides)
        along = np.empty_like(arrived[axis])
        still_to_come(along, state.acceleration[axis], velocity[axis], state.velocity[axis], dt)
        if lasting is not None:
            along *= beside_faces(lasting, axis, sides)
        carried = carry_component(velocity[axis], along, axis, transport, inlets, grid, sides)
        arrived[axis][:] = carried.velocity
        crossed[axis] = fluid.density * carried.crossed
        held[axis] = fluid.density * carried.held
        brought = dt * float(inlets.gain @ inlets.velocity)
        gained[axis] = fluid.density * (brought - float(carried.drained.sum()))
        for jet, taken in zip(jets, drunk, strict=True):
            taken[axis] = taken_by(jet, axis, inlets, carried.drained, grid, sides)
    masses = face_masses(transport.after, fluid.density)
    reached = fluid_momentum(arrived, masses, grid, sides)
    impose_sides(arrived, grid, sides, transport.time + dt)
    return Carried(
        arrived,
        dyed,
        transport.after,
        np.zeros(3),
        crossed,
        held + fluid_momentum(arrived, masses, grid, sides) - reached,
        gained,
        tuple(after_drinking(jet, taken, dt) for jet, taken in zip(jets, drunk, strict=True)),
    )


def carry_along_paths(
    world: World,
    before: Geometry,
    transport: Transport,
    paths: Faces,
    dyed: Dyed,
    jets: tuple[Jet, ...],
) -> Carried:
    """Velocity a step later by the paper's scheme: semi-Lagrangian, with what it loses."""
    fluid, state = world.flow()
    grid, sides, dt = fluid.grid, fluid.boundaries, transport.dt
    start, end = transport.before, transport.after
    carried = faces_of([u.copy() for u in state.velocity])
    fill_mouths(carried, jets, grid)
    field, arrived = pad_faces(carried, grid, sides, world.time), grid.zeros_faces()
    counts, periodic = np.array(grid.shape), np.array(sides.periodic(), np.uint8)
    for axis in grid.axes:
        carry(arrived[axis], field[axis], *paths, OFFSETS[axis], counts, periodic)
    end.follow(arrived, grid)
    was = fluid_momentum(state.velocity, face_masses(start, fluid.density), grid, sides)
    now = fluid_momentum(arrived, face_masses(end, fluid.density), grid, sides)
    crossed = dt * carried_in(state.velocity, before.open, grid, sides, fluid.density)
    expelled = dt * jet_force(jets, fluid.density)
    lost = now - was - crossed - expelled
    return Carried(arrived, dyed, end, lost, crossed, np.zeros(3), expelled, jets)


def particle_paths(
    world: World, q: Array, before: Geometry, jets: tuple[Jet, ...], dt: float
) -> Faces:
    """Padded Faces, cells per step, along which velocity goes in the paper's scheme: that of the
    fluid through the open and of the bodies through the closed part of each face.

    q  (nq,) positions of the bodies in the grid `before`
    """
    fluid, state = world.flow()
    pose = kinematics(world.setup.solid, q)
    field = leak_proof(
        state.advecting_velocity, before, boundary_velocity(pose, world.solid.v), fluid.grid
    )
    add_closed_slip(field, jets, fluid.grid)
    padded = pad_faces(field, fluid.grid, fluid.boundaries, world.time)
    return cells_per_step(padded, dt, fluid.grid.spacing)


def forced(
    carried: Faces, opened: Faces, mass: Faces, fluid: Fluid, time: float, dt: float
) -> Faces:
    """Velocity with the body force, driven regions and prescribed sides.

    A body force acts as the pressure does that balances it, on the open part of a face.

    time  s at the end of the step
    """
    grid = fluid.grid
    velocity = faces_of([u.copy() for u in carried])
    if any(fluid.body_force):
        rates = accelerated(opened, mass, grid)
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


def source_rate(fluid: Fluid, time: float, opened: Faces) -> Array:
    """(nx, ny, nz) volume that appears in each cell, m^3/s; none in cells wholly inside a body."""
    grid = fluid.grid
    rate = np.zeros(grid.shape)
    for source in fluid.sources:
        if source.volume_rate is None or not source.active(time):
            continue
        box = cells_in(source, grid)
        clear = np.ones(rate[box].shape, bool)
        for axis in grid.axes:
            wide = list(box)
            wide[axis] = slice(box[axis].start, box[axis].stop + 1)
            part = opened[axis][tuple(wide)] > 0.0
            clear &= part[edge(axis, slice(None, -1))] | part[edge(axis, slice(1, None))]
        if clear.any():
            rate[box][clear] += source.volume_rate / np.count_nonzero(clear)
    return rate


def settle_state(
    world: World,
    carried: Carried,
    started: Faces,
    velocity: Faces,
    inside: Faces,
    dt: float,
) -> None:
    """Put the new velocity into the state, and where it will be half a step on.

    started   Faces at the start of the step, with what they were given then
    velocity  Faces u after the solve
    inside    Faces, the leak-proof field of it and of the bodies' velocity
    """
    fluid, state = world.flow()
    grid, sides = fluid.grid, fluid.boundaries
    for axis in grid.axes:
        fill_empty_faces(velocity[axis], carried.volumes.merged[axis], inside[axis])
    carried.volumes.follow(velocity, grid)
    for axis in grid.axes:
        u, given, advecting_velocity = (
            velocity[axis],
            state.acceleration[axis],
            state.advecting_velocity[axis],
        )
        volume = carried.volumes.volume[axis]
        beside = parts(volume, volume, axis, grid, sides)
        gained(given, u, carried.velocity[axis], started[axis], state.velocity[axis], dt)
        move_on(state.velocity[axis], u, advecting_velocity)
        given.reshape(-1)[beside], advecting_velocity.reshape(-1)[beside] = (
            0.0,
            u.reshape(-1)[beside],
        )
        if sides.periodic()[axis]:
            first, last = edge(axis, 0), edge(axis, -1)
            given[last], advecting_velocity[last] = (
                given[first],
                u[last] + (advecting_velocity[first] - u[first]),
            )
    state.cells = carried.volumes.cells
    state.pose = world.solid.q.copy()
