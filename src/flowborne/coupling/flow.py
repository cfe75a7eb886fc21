"""The fluid's half of a step: what happens to it between two coupled solves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne.coupling.fractions import Geometry
from flowborne.coupling.jet_momentum import give_missing, momentum_due
from flowborne.coupling.mouths import Jet, colour, fill_mouths, jet_force, jet_power
from flowborne.coupling.operators import (
    carried_in,
    energy_carried_in,
    face_mass,
    fluid_momentum,
)
from flowborne.coupling.world import Fluid, World
from flowborne.fluid.advection import OFFSETS, SMOOTH, carry, cells_per_step, correct
from flowborne.fluid.continuation import LAYERS, continue_into
from flowborne.fluid.energy import energy, without_gain
from flowborne.fluid.ghosts import impose_sides, pad, pad_faces
from flowborne.fluid.grid import Array, Faces, Grid
from flowborne.fluid.scalars import carry_scalars, cells_in
from flowborne.solids.momentum import halfway_momentum

SLACK = 0.02
"""Share of the energy that crosses the sides in a step by which its sum may be wrong."""

WHOLE = 0.9
"""A face as open as this counts as uncut."""


@dataclass
class Carried:
    """What advection and forces gave.

    velocity  Faces u*, m/s
    scalars   name -> (nx, ny, nz)
    start     (3,) momentum of the fluid at the start of the step, N s
    lost      (3,) momentum that advection made (or lost, when negative), N s, before it was given
              back along periodic axes
    crossed   (3,) momentum that the flow carried in through the sides, N s
    expelled  (3,) momentum that came in through mouths, N s
    """

    velocity: Faces
    scalars: dict[str, Array]
    start: Array
    lost: Array
    crossed: Array
    expelled: Array


def carry_fluid(
    world: World,
    before: Geometry,
    after: Geometry,
    jets: tuple[Jet, ...],
    drift: Array,
    dt: float,
) -> Carried:
    """Advect velocity and scalars by the leak-proof field (section 6).

    With the acceleration A = (u - u*)/dt of the last step, c = u + dt/2 A is the velocity of a
    particle half-way; c is what is carried, along the paths of c, and dt/2 A is taken off where
    the particle arrives. The pressure solve then adds dt A for the new A, so a steady flow stays
    as it is and the step is second order in time. The semi-Lagrangian scheme of the paper carries
    u itself. So do particles that cross two cells or more in a step: extrapolation in time is not
    stable there. What cut faces hold beside free-slip bodies is not carried, see `beside_walls`.
    What mouths let through keeps its momentum, see `jet_momentum`.

    Neither scheme keeps momentum. Along periodic axes, where no side can make up for it, what was
    lost is given back evenly; a creature in a periodic box swims by its strokes alone. The mass of
    cut cells wavers a little as bodies move over the grid: that part moves with the whole.

    jets   of the mouths before the step
    drift  (3,) velocity of the whole, m/s
    """
    fluid, state = world.flow()
    grid, sides, time = fluid.grid, fluid.boundaries, world.time
    crossed = courant(state.velocity, dt, grid)
    ahead = half_a_step(state.acceleration, crossed, fluid, dt)
    halfway = faces_of([u + a for u, a in zip(state.velocity, ahead, strict=True)])
    mass_before = face_mass(before.open, grid, sides, fluid.density)
    due = momentum_due(halfway, before.open, mass_before, jets, grid, fluid.density, dt)
    resident = grid.zeros_faces()
    if fluid.viscosity == 0.0:
        resident = beside_walls(halfway, before.open, crossed, grid)
    fill_mouths(halfway, resident, jets, grid)
    paths = faces_of([c + a * o for c, a, o in zip(state.carrier, ahead, before.open, strict=True)])
    carrier = cells_per_step(pad_faces(paths, grid, sides, time), dt, grid.spacing)
    most = energy_bound(halfway, before.open, mass_before, jets, fluid, dt)
    arrived = advected(halfway, carrier, mass_before, most, fluid, time, dt)
    for axis in grid.axes:
        arrived[axis][:] -= ahead[axis]
        arrived[axis][:] += resident[axis]
    mass_after = face_mass(after.open, grid, sides, fluid.density)
    give_missing(due, arrived, ahead, mass_after, after, grid)
    scalars = carry_scalars(
        state.scalars,
        carrier,
        before.distance,
        after.distance,
        grid,
        sides,
        fluid.sources,
        time + dt,
    )
    colour(scalars, jets, after, grid, dt)
    expelled = dt * jet_force(jets, fluid.density)
    was = fluid_momentum(state.velocity, mass_before, grid)
    now = fluid_momentum(arrived, mass_after, grid)
    for axis in grid.axes:
        if sides.periodic()[axis]:
            mass = mass_after[axis].sum()
            kept = was[axis] + expelled[axis] + (mass - mass_before[axis].sum()) * drift[axis]
            arrived[axis][:] += (kept - now[axis]) / mass
    entered = dt * carried_in(state.velocity, before.open, grid, sides, fluid.density)
    return Carried(arrived, scalars, was, now - was - entered - expelled, entered, expelled)


def half_a_step(acceleration: Faces, crossed: Faces, fluid: Fluid, dt: float) -> Faces:
    """dt/2 A, none where two cells or more are crossed in a step and in the paper's scheme, m/s."""
    if fluid.advection == "semi-lagrangian":
        return fluid.grid.zeros_faces()
    share = [np.clip(2.0 - c, 0.0, 1.0) for c in crossed]
    return faces_of([0.5 * dt * s * a for s, a in zip(share, acceleration, strict=True)])


def energy_bound(
    velocity: Faces, opened: Faces, mass: Faces, jets: tuple[Jet, ...], fluid: Fluid, dt: float
) -> float:
    """Energy after a step with what comes in through sides and mouths, and what may be wrong with
    that, J. Infinite where advection needs no bound: in the paper's scheme, which loses energy, and
    in a slab, whose eddies grow; those of a room break up and would feed on MacCormack's scheme."""
    if fluid.grid.is_slab or fluid.advection == "semi-lagrangian":
        return np.inf
    came, went = energy_carried_in(velocity, opened, fluid.grid, fluid.boundaries, fluid.density)
    blown, taken = jet_power(jets, fluid.density)
    came, went = came + blown, went + taken
    return energy(velocity, mass) + dt * (came - went + SLACK * (came + went))


def advected(
    velocity: Faces,
    carrier: Faces,
    mass: Faces,
    most: float,
    fluid: Fluid,
    time: float,
    dt: float,
) -> Faces:
    """A velocity carried for a step that starts at `time` (s).

    carrier  padded Faces, cells per step
    mass     of each face, kg
    most     J, energy that MacCormack's scheme is held to, see `energy_bound`
    """
    grid, sides = fluid.grid, fluid.boundaries
    counts, periodic = np.array(grid.shape), np.array(sides.periodic(), np.uint8)
    field = pad_faces(velocity, grid, sides, time)
    everywhere = [np.ones(u.shape, np.uint8) for u in field]
    arrived = grid.zeros_faces()
    for axis in grid.axes:
        carry(
            arrived[axis], field[axis], everywhere[axis], *carrier, OFFSETS[axis], counts, periodic
        )
    if fluid.advection == "semi-lagrangian":
        return arrived
    plain = arrived if most == np.inf else faces_of([a.copy() for a in arrived])
    impose_sides(arrived, grid, sides, time + dt)
    there = pad_faces(arrived, grid, sides, time + dt)
    for axis in grid.axes:
        correct(
            arrived[axis],
            there[axis],
            field[axis],
            everywhere[axis],
            *carrier,
            OFFSETS[axis],
            counts,
            periodic,
            SMOOTH,
        )
    if most < np.inf:
        without_gain(arrived, plain, mass, most)
    return arrived


def drift_velocity(world: World, cut: Geometry, dt: float) -> Array:
    """(3,) velocity of the centre of mass of fluid and bodies together, m/s.

    It is asked for along periodic axes only, and is 0 where there are none.
    """
    fluid, state = world.flow()
    if not any(fluid.boundaries.periodic()):
        return np.zeros(3)
    model = world.setup.solid
    mass = face_mass(cut.open, fluid.grid, fluid.boundaries, fluid.density)
    total = fluid_momentum(state.velocity, mass, fluid.grid)
    total += halfway_momentum(model, world.solid, dt)[0]
    masses = np.array([m.sum() for m in mass]) + model.body_mass.sum()
    return np.asarray(np.divide(total, masses, out=np.zeros(3), where=masses > 0.0))


def beside_walls(carried: Faces, opened: Faces, crossed: Faces, grid: Grid) -> Faces:
    """Make the flow beside free-slip bodies that of the whole faces around, in place.

    A cut face holds the mean over what is left of it. Carried off as if it were the flow there, it
    would leave a wake behind a body that has none. So the flow over whole faces, continued along
    straight lines, is carried in its place.

    opened, crossed  open fraction, and cells crossed in a step
    returns          Faces, what cut faces held besides and keep until new fluid has come to them:
                     all of it in a short step, none once half a cell is crossed
    """
    resident = grid.zeros_faces()
    for axis in grid.axes:
        whole, cut = opened[axis] > WHOLE, opened[axis] > 0.0
        if whole.all():
            continue
        held = carried[axis].copy()
        continue_into(carried[axis], whole.view(np.uint8), LAYERS)
        stays = np.clip(1.0 - 2.0 * crossed[axis], 0.0, 1.0)
        resident[axis][cut] = (stays * (held - carried[axis]))[cut]
    return resident


def courant(velocity: Faces, dt: float, grid: Grid) -> Faces:
    """Cells that the fluid around each face crosses in a step."""
    cells = np.zeros(grid.shape)
    for axis in grid.axes:
        speed = np.abs(velocity[axis])
        for beside in (np.delete(speed, -1, axis), np.delete(speed, 0, axis)):
            np.maximum(cells, beside, out=cells)
    cells *= dt / grid.spacing
    around = grid.zeros_faces()
    for axis in grid.axes:
        wide = pad(cells, (axis,))
        around[axis][:] = np.maximum(np.delete(wide, -1, axis), np.delete(wide, 0, axis))
    return around


def faces_of(values: list[Array]) -> Faces:
    """Three arrays as Faces."""
    return values[0], values[1], values[2]


def forced(carried: Faces, fluid: Fluid, time: float, dt: float) -> Faces:
    """Velocity with the body force, driven regions and prescribed sides.

    time  s at the end of the step
    """
    grid = fluid.grid
    velocity = faces_of([u + dt * f for u, f in zip(carried, fluid.body_force, strict=True)])
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
    world: World, after: Geometry, velocity: Faces, start: Faces, leak_free: Faces, dt: float
) -> None:
    """Put the new velocity into the state, continued a few layers into the bodies.

    velocity   Faces u after the solve
    start      Faces u* after advection
    leak_free  Faces, the leak-proof field of `velocity`
    """
    fluid, state = world.flow()
    sticky = fluid.viscosity > 0.0
    for axis in fluid.grid.axes:
        opened = after.open[axis] > 0.0
        u, a = velocity[axis], (velocity[axis] - start[axis]) / dt
        a[~opened] = 0.0
        if not opened.all():
            u[~opened] = leak_free[axis][~opened]
            if not sticky:
                continue_into(u, opened.view(np.uint8), LAYERS)
            continue_into(a, opened.view(np.uint8), LAYERS)
        state.velocity[axis][:] = u
        state.acceleration[axis][:] = a
        state.carrier[axis][:] = leak_free[axis]
