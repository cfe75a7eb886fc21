"""The fluid's half of a step: what happens to it between two coupled solves (paper, section 6).

Deviations from the paper: momentum is carried in flux form in place of along particle paths, which
lose a tenth of what a swimmer exchanges; and the field that carries it is that of the middle of the
step, from the last two velocities, in place of a solve of its own. The paper's own scheme is an
option, see `advection`.
"""

from __future__ import annotations

import numpy as np

from flowborne.coupling.advection.scheme import Carried, Departure
from flowborne.coupling.fractions import Geometry
from flowborne.coupling.inlets import brought_by
from flowborne.coupling.leak_proof import leak_proof_flux
from flowborne.coupling.mouths import Jet, add_rates
from flowborne.coupling.world import Fluid, World
from flowborne.fluid.boundary import cells_in
from flowborne.fluid.control_volumes import ControlVolumes, control_volumes, parts
from flowborne.fluid.dye import Dyed, Passage, carry_dye
from flowborne.fluid.ghosts import edge, impose_sides
from flowborne.fluid.grid import Array, Faces, faces_of
from flowborne.fluid.projection import accelerated
from flowborne.fluid.transport import Transport
from flowborne.kernels.faces import fill_empty_faces, gained, move_on
from flowborne.solids.state import SolidState


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


def carry_fluid(
    world: World,
    velocity: Faces,
    bodies: SolidState,
    before: Geometry,
    start: ControlVolumes,
    after: Geometry,
    jets: tuple[Jet, ...],
    dt: float,
) -> tuple[Carried, Dyed]:
    """Velocity and scalars a step later, carried by the leak-proof field.

    velocity       Faces at its start, m/s
    bodies         at its start
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
    departure = Departure(
        fluid.grid,
        sides,
        fluid.density,
        state,
        velocity,
        transport,
        before,
        jets,
        sources,
        world.setup.solid,
        bodies,
    )
    return fluid.advection.carry(departure), dyed


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
