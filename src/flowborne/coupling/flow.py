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
from flowborne.coupling.inlets import after_drinking, inlets_across, taken_by
from flowborne.coupling.leak_proof import leak_proof_flux
from flowborne.coupling.mouths import (
    Jet,
    add_closed_slip,
    add_rates,
    colour,
    fill_mouths,
    jet_force,
)
from flowborne.coupling.operators import carried_in, leak_proof, motion
from flowborne.coupling.world import Fluid, World
from flowborne.fluid.advection import OFFSETS, carry, cells_per_step
from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.control_volumes import ControlVolumes, control_volumes, parts
from flowborne.fluid.ghosts import edge, impose_sides, pad_faces
from flowborne.fluid.grid import Array, Faces, Grid, faces_of
from flowborne.fluid.projection import accelerated
from flowborne.fluid.scalars import carry_scalars, cells_in
from flowborne.fluid.transport import Transport, carry_component
from flowborne.solids.dynamics import kinematics


@dataclass(frozen=True)
class Carried:
    """What advection gave.

    velocity  Faces u*, m/s
    scalars   name -> (nx, ny, nz)
    volumes   control volumes at the end of the step
    start     (3,) momentum of the fluid at the start of the step, N s
    lost      (3,) momentum that advection made (or lost, when negative), N s; none in flux form
    crossed   (3,) momentum that the flow carried in through the sides, N s
    stopped   (3,) momentum that the sides which prescribe a velocity gave to what reached them, N s
    expelled  (3,) momentum that came in through mouths and sources, N s
    jets      of the mouths, those that drink with the velocity of what they drank
    """

    velocity: Faces
    scalars: dict[str, Array]
    volumes: ControlVolumes
    start: Array
    lost: Array
    crossed: Array
    stopped: Array
    expelled: Array
    jets: tuple[Jet, ...]


def volumes_of(world: World, cut: Geometry) -> ControlVolumes:
    """The control volumes of the fluid as it stands: those that the last step left in the cells, or
    those of the cut where the bodies have been put elsewhere since."""
    fluid, state = world.flow()
    left = np.array_equal(state.pose, world.solid.q) and state.cells.shape == cut.volume.shape
    cells = state.cells if left else cut.volume
    return control_volumes(cells, cut.open, fluid.grid, fluid.boundaries)


def face_masses(volumes: ControlVolumes, density: float) -> Faces:
    """Mass of the fluid that pressure on each face accelerates, kg; 0 at guests."""
    return faces_of([density * v for v in volumes.merged])


def fluid_momentum(velocity: Faces, mass: Faces, grid: Grid, sides: Boundaries) -> Array:
    """(3,) linear momentum of the fluid, N s."""
    total = np.zeros(3)
    for axis in grid.axes:
        own = edge(axis, slice(None, -1 if sides.periodic()[axis] else None))
        total[axis] = float(np.vdot(mass[axis][own], velocity[axis][own]))
    return total


def kinetic_energy(velocity: Faces, mass: Faces, grid: Grid, sides: Boundaries) -> float:
    """Kinetic energy of the fluid, J."""
    squares = faces_of([0.5 * u * u for u in velocity])
    return float(fluid_momentum(squares, mass, grid, sides).sum())


def carry_fluid(
    world: World,
    q: Array,
    before: Geometry,
    start: ControlVolumes,
    after: Geometry,
    jets: tuple[Jet, ...],
    dt: float,
) -> Carried:
    """Velocity and scalars a step later, carried by the leak-proof field.

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
        state.carrier, before, after, start.cells, rate, fluid, middle, dt
    )
    end = control_volumes(cells, after.open, fluid.grid, sides)
    paths = particle_paths(world, q, before, jets, dt)
    scalars = carry_dye(world, paths, before, after, jets, dt)
    if fluid.advection == "semi-lagrangian":
        return carry_along_paths(world, before, start, end, paths, scalars, jets, dt)
    held = fluid.viscosity / fluid.density
    transport = Transport(flux, start, end, dt, world.time, held)
    return carry_in_flux_form(world, transport, sources, scalars, jets)


def carry_in_flux_form(
    world: World,
    transport: Transport,
    sources: Array,
    scalars: dict[str, Array],
    jets: tuple[Jet, ...],
) -> Carried:
    """Velocity a step later, on moving control volumes (see `transport`).

    sources  (nx, ny, nz) what they bring into each cell, m^3/s
    scalars  a step later
    """
    fluid, state = world.flow()
    grid, sides, dt = fluid.grid, fluid.boundaries, transport.dt
    arrived, crossed, gained = grid.zeros_faces(), np.zeros(3), np.zeros(3)
    drunk = [np.zeros(3) for _ in jets]
    for axis in grid.axes:
        inlets = inlets_across(axis, jets, sources, grid, sides)
        along = state.acceleration[axis]
        carried = carry_component(state.velocity[axis], along, axis, transport, inlets, grid, sides)
        arrived[axis][:] = carried.velocity
        crossed[axis] = fluid.density * carried.crossed
        brought = dt * float(inlets.gain @ inlets.velocity)
        gained[axis] = fluid.density * (brought - float(carried.drained.sum()))
        for jet, taken in zip(jets, drunk, strict=True):
            taken[axis] = taken_by(jet, axis, inlets, carried.drained, grid, sides)
    masses = face_masses(transport.after, fluid.density)
    reached = fluid_momentum(arrived, masses, grid, sides)
    impose_sides(arrived, grid, sides, transport.time + dt)
    masses_before = face_masses(transport.before, fluid.density)
    return Carried(
        arrived,
        scalars,
        transport.after,
        fluid_momentum(state.velocity, masses_before, grid, sides),
        np.zeros(3),
        crossed,
        fluid_momentum(arrived, masses, grid, sides) - reached,
        gained,
        tuple(after_drinking(jet, taken, dt) for jet, taken in zip(jets, drunk, strict=True)),
    )


def carry_along_paths(
    world: World,
    before: Geometry,
    start: ControlVolumes,
    end: ControlVolumes,
    paths: Faces,
    scalars: dict[str, Array],
    jets: tuple[Jet, ...],
    dt: float,
) -> Carried:
    """Velocity a step later by the paper's scheme: semi-Lagrangian, with what it loses."""
    fluid, state = world.flow()
    grid, sides = fluid.grid, fluid.boundaries
    carried = faces_of([u.copy() for u in state.velocity])
    fill_mouths(carried, jets, grid)
    field, arrived = pad_faces(carried, grid, sides, world.time), grid.zeros_faces()
    counts, periodic = np.array(grid.shape), np.array(sides.periodic(), np.uint8)
    for axis in grid.axes:
        everywhere = np.ones(field[axis].shape, np.uint8)
        carry(arrived[axis], field[axis], everywhere, *paths, OFFSETS[axis], counts, periodic)
    end.follow(arrived, grid)
    was = fluid_momentum(state.velocity, face_masses(start, fluid.density), grid, sides)
    now = fluid_momentum(arrived, face_masses(end, fluid.density), grid, sides)
    crossed = dt * carried_in(state.velocity, before.open, grid, sides, fluid.density)
    expelled = dt * jet_force(jets, fluid.density)
    lost = now - was - crossed - expelled
    return Carried(arrived, scalars, end, was, lost, crossed, np.zeros(3), expelled, jets)


def particle_paths(
    world: World, q: Array, before: Geometry, jets: tuple[Jet, ...], dt: float
) -> Faces:
    """Padded Faces, cells per step, along which dye goes and, in the paper's scheme, velocity: that
    of the fluid through the open and of the bodies through the closed part of each face. Empty
    where nothing goes along them.

    q  (nq,) positions of the bodies in the grid `before`
    """
    fluid, state = world.flow()
    if not state.scalars and fluid.advection != "semi-lagrangian":
        return faces_of([np.zeros((0, 0, 0))] * 3)
    pose = kinematics(world.setup.solid, q)
    field = leak_proof(state.carrier, before, motion(pose, world.solid.v), fluid.grid)
    add_closed_slip(field, jets, fluid.grid)
    padded = pad_faces(field, fluid.grid, fluid.boundaries, world.time)
    return cells_per_step(padded, dt, fluid.grid.spacing)


def carry_dye(
    world: World,
    paths: Faces,
    before: Geometry,
    after: Geometry,
    jets: tuple[Jet, ...],
    dt: float,
) -> dict[str, Array]:
    """The scalars a step later, along particle paths."""
    fluid, state = world.flow()
    if not state.scalars:
        return {}
    scalars = carry_scalars(
        state.scalars,
        paths,
        before.distance,
        after.distance,
        fluid.grid,
        fluid.boundaries,
        fluid.sources,
        world.time + dt,
    )
    colour(scalars, jets, after, fluid.grid, dt)
    return scalars


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
        clear = np.zeros(grid.shape, bool)
        clear[box] = True
        for axis in grid.axes:
            lower = np.delete(opened[axis], -1, axis) > 0.0
            clear &= lower | (np.delete(opened[axis], 0, axis) > 0.0)
        if clear.any():
            rate[clear] += source.volume_rate / np.count_nonzero(clear)
    return rate


def settle_state(
    world: World,
    carried: Carried,
    velocity: Faces,
    inside: Faces,
    cut: Geometry,
    dt: float,
) -> None:
    """Put the new velocity into the state, and where it will be half a step on.

    velocity  Faces u after the solve
    inside    Faces, the leak-proof field of it and of the bodies' velocity
    """
    fluid, state = world.flow()
    grid, sides = fluid.grid, fluid.boundaries
    for axis in grid.axes:
        closed = cut.open[axis] == 0.0
        velocity[axis][closed] = inside[axis][closed]
    carried.volumes.follow(velocity, grid)
    for axis in grid.axes:
        u, was = velocity[axis], state.velocity[axis]
        change, given = u - was, (u - carried.velocity[axis]) / dt
        volume = carried.volumes.volume[axis]
        beside = parts(volume, volume, axis, grid, sides)
        change.reshape(-1)[beside], given.reshape(-1)[beside] = 0.0, 0.0
        if sides.periodic()[axis]:
            given[edge(axis, -1)] = given[edge(axis, 0)]
            change[edge(axis, -1)] = change[edge(axis, 0)]
        state.acceleration[axis][:] = given
        state.carrier[axis][:] = u + 0.5 * change
        state.velocity[axis][:] = u
    state.cells = carried.volumes.cells
    state.pose = world.solid.q.copy()
