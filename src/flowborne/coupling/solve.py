"""The monolithic solve: pressure, viscosity, bodies, joints and contact in one system.

Eq. (9) of the paper with the bodies eliminated is symmetric positive definite in p^ = p dt
(Robinson-Mosher, Schroeder and Fedkiw 2011):

    ( K + J A^-1 J^T ) p^ = -( D u* + J v* )
    u+ = u* - (1/rho) G p^          v+ = v* + A^-1 J^T p^

A^-1 has the prescribed dofs projected out; active contact rows and joint limits are part of A. When
the solution opens a contact that was taken as pressed, or the other way round, asks a drive for
more than its torque limit, or moves the bodies otherwise than their Coriolis forces were made for,
the system is solved again with that changed: the first time only roughly where that is to be
expected, to the full tolerance in the end. Viscosity is solved again for new contacts only, as what
the others change is small in dt, and where it is strong (`creeping`).

Method: docs/method/coupled-solve.md.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from math import prod, sqrt

import numpy as np

from flowborne.coupling.creeping import SWEEPS, Sweeps, creeps
from flowborne.coupling.cut import gradient_on, source_rate
from flowborne.coupling.fractions import Geometry
from flowborne.coupling.mouths import Jet, add_rates
from flowborne.coupling.operators import (
    add_flux,
    beyond_sides,
    boundary_velocity,
    generalised,
    motion_of,
    pressure_push,
    side_push,
)
from flowborne.coupling.report import Outcome, timed
from flowborne.coupling.viscous_solve import viscosity_on
from flowborne.coupling.world import Fluid, World
from flowborne.fluid.control_volumes import ControlVolumes
from flowborne.fluid.ghosts import plane, planes
from flowborne.fluid.grid import Grid
from flowborne.fluid.projection import PressureGradient, face_weights
from flowborne.kernels.arrays import ROUNDING, Array, Faces, Integers
from flowborne.kernels.coupling_rows import fastest_closed
from flowborne.kernels.faces import largest_open, largest_size
from flowborne.kernels.projection import fill_fresh, open_outflow
from flowborne.solids.driven import Driven, within_limits
from flowborne.solids.dynamics import Kinematics
from flowborne.solvers.mobility import Mobility
from flowborne.solvers.pressure import NO_REACTION, NO_TERM, LowRankTerm, PressureSystem

PASSES = 50
"""Most times that contacts, torque limits and Coriolis forces are corrected in one step."""

ROUGH = 1e-3
"""Relative residual of the first of several solves of one step, whose bodies are corrected anyway.
The next has the full tolerance, and those after it go on from there: their corrections are small.
"""

SPLIT_TOLERANCE = 1e-3
"""Relative residual of the added-mass part of the pressure, whose forces are then off by 2e-4 at
most (flyer-twist) and 1e-5 to 6e-5 in the mean. Both parts add up whatever it is."""

PROBES = 4
"""Fields of random signs by which the yielding of flesh is estimated."""


@dataclass(frozen=True)
class Solved:
    """The bodies' velocities at the end of a step, and what led to them.

    driven       the bodies' system in its last form
    v, actuator  (nv,) velocity and forces of the drives
    outcome      DONE, or which solve missed its tolerance, or that contacts, limits or Coriolis
                 forces did not settle
    unsettled    (k,) dofs as in `StepReport`
    """

    driven: Driven
    v: Array
    actuator: Array
    outcome: Outcome
    unsettled: Integers


@dataclass(frozen=True)
class SolvedFlow(Solved):
    """The same with the fluid's. Impulses (k,) on bodies are wrenches about the world origin, then
    forces on vertices of flesh, N s and N m s.

    viscous_impulse  (k,)
    added_mass       (k,) the part of `impulse` of `added_mass_impulse`, or what gives it; nan in
                     trials
    before_pressure  Faces, m/s
    velocity         Faces u+, m/s
    pressure         (nx, ny, nz) p, Pa
    impulse          (k,) J^T p^
    sides            (3,) impulse of the sides on the fluid, N s; nan without balances
    iterations       of the pressure solve, all turns of a step together
    sweeps           of viscosity and pressure, see `creeping`
    sweep_error      what they are apart by at the end, relative to the pressure
    residual         true relative residual
    divergence       largest |net outflow of a cell| / volume, 1/s; nan without balances
    fastest          largest |u+| on an open face, m/s; likewise
    """

    viscous_impulse: Array
    added_mass: Array | Callable[[], Array]
    before_pressure: Faces
    velocity: Faces
    pressure: Array
    impulse: Array
    sides: Array
    iterations: int
    sweeps: int
    sweep_error: float
    residual: float
    divergence: float
    fastest: float


def correct(driven: Driven, v: Array, actuator: Array, limit: Array) -> Driven | None:
    """The bodies' system with the drives that the solution implies, or where it has them with the
    contacts and forces of Coriolis; None if it has all of them.

    A drive that gives way has another velocity than the solution's, so what follows from velocities
    comes after.
    """
    return within_limits(driven, limit, v, actuator) or driven.updated(v)


def unsettled(driven: Driven, changed: Driven | None, v: Array) -> Integers:
    """(k,) dofs whose contacts, joint limits or drives `v` (nv,) asks to change; none when it asks
    for no change."""
    if changed is None:
        return np.zeros(0, np.int64)
    system = driven.system
    wrong = (driven.prescribed != changed.prescribed) | (driven.limited != changed.limited)
    if system.rows is not None:
        zones = system.rows.zones((v - system.v) / system.dt, system.zones)
        wrong |= np.any(system.rows.J[zones != system.zones] != 0.0, axis=0)
    return np.flatnonzero(wrong)


def solve_bodies(driven: Driven, torque_limit: Array) -> Solved:
    """Bodies without a fluid."""
    none, tried = np.zeros(driven.velocity.size), driven
    for _ in range(PASSES):
        actuator = driven.actuator(driven.velocity, none)
        changed = correct(driven, driven.velocity, actuator, torque_limit)
        if changed is None:
            break
        tried, driven = driven, changed
    left = unsettled(tried, changed, tried.velocity)
    outcome = Outcome.DONE if changed is None else Outcome.NOT_SETTLED
    return Solved(driven, driven.velocity, actuator, outcome, left)


@timed("projection")
def solve_together(
    world: World,
    velocity: Faces,
    volumes: ControlVolumes,
    driven: Driven,
    pose: Kinematics,
    cut: Geometry,
    jets: tuple[Jet, ...],
    torque_limit: Array,
) -> SolvedFlow:
    """Viscosity, pressure and bodies at the end of the step (section 6, item 6).

    velocity  Faces u*, m/s, after advection and forces
    volumes   control volumes at the end of the step
    jets      of the mouths at the end of the step
    returns   velocity without divergence on the open parts of the faces, the bodies' velocity
              with driven dofs exactly at their targets, and what each gave to the other
    """
    dt = driven.system.dt
    fluid, state = world.flow()
    mobility = driven.mobility(pose)
    gradient, matrix = pressure_on(world, volumes, cut, mobility)
    pressure = dt * state.pressure
    tolerance = fluid.tolerance
    if changes_under(pressure, cut, pose, driven, torque_limit):
        tolerance = max(tolerance, ROUGH)
    rate = source_rate(fluid, world.time + dt, cut.open)
    add_rates(rate, jets)
    viscosity = viscosity_on(world, velocity, volumes, gradient, cut, jets, pose, driven)
    term, given = LowRankTerm(cut.rows, mobility), filled_pressure(state.pressure, cut, fluid)
    smooth, viscous, smoothed = viscosity.solve(driven, given)
    grid, net = fluid.grid, np.empty(fluid.grid.shape)
    net_outflow(net, smooth, cut, rate, grid)
    floor = rounding_floor(smooth, cut, boundary_velocity(pose, driven.velocity), fluid.grid)
    iterations, tried = 0, driven
    sweeps = None
    if viscosity.system is not None and creeps(fluid, dt):
        yields = viscosity.system.yields(cut.open)
        sweeps = Sweeps(cut.volume, yields, matrix.closed_regions(), dt)
    for _ in range(PASSES * (SWEEPS if sweeps else 1)):
        start = boundary_velocity(pose, driven.after(generalised(pose, viscous)))
        rhs = -net
        add_flux(rhs, cut, -start)
        solution = matrix.solve(rhs, pressure, term, tolerance, floor)
        iterations += solution.iterations
        on_solids = pressure_push(cut, solution.pressure, start.size)
        impulse = generalised(pose, viscous + on_solids)
        v = driven.after(impulse)
        actuator = driven.actuator(v, impulse)
        changed = correct(driven, v, actuator, torque_limit)
        pressure, again = solution.pressure, False
        if changed is not None:
            again = not changed.same_mobility(driven)
            if again:
                term = replace(term, mobility=changed.mobility(pose))
                if sweeps:
                    sweeps.forget()
            tried, driven = driven, changed
        elif tolerance <= fluid.tolerance:
            if sweeps is None:
                break
            push = generalised(pose, viscous + pressure_push(cut, dt * given, start.size))
            field, outflow = grid.empty_faces(), np.empty(grid.shape)
            gradient.subtract(smooth, given, dt, field)
            net_outflow(outflow, field, cut, rate, grid)
            add_flux(outflow, cut, boundary_velocity(pose, driven.after(push)))
            better = sweeps.next(dt * given, solution.pressure, outflow)
            if better is None:
                break
            again, pressure, given = True, better, better / dt
        if again:
            smooth, viscous, smoothed = viscosity.solve(driven, given)
            net_outflow(net, smooth, cut, rate, grid)
        tolerance = fluid.tolerance
    after = grid.empty_faces()
    gradient.subtract(smooth, solution.pressure, 1.0, after)
    left = unsettled(tried, changed, v)
    outcome = Outcome.DONE if changed is None else Outcome.NOT_SETTLED
    if not smoothed:
        outcome = Outcome.VISCOSITY_NOT_CONVERGED
    if not solution.converged:
        outcome = Outcome.PRESSURE_NOT_CONVERGED
    plain = partial(pressure_system, gradient, cut.open)
    added_mass: Array | Callable[[], Array] = np.full(start.size, np.nan)
    pushed = np.full(3, np.nan)
    divergence = fastest = np.nan
    if world.setup.balances or world.setup.splits:
        change = boundary_velocity(pose, v - driven.system.v)
    if world.setup.balances:
        moved = start + term.mobility.times(on_solids)
        net_outflow(net, after, cut, rate, grid)
        add_flux(net, cut, moved)
        divergence = largest_size(net) / fluid.grid.cell_volume
        fastest = max(largest_open(after[axis], cut.open[axis], 0.0) for axis in fluid.grid.axes)
        pushed = side_push(solution.pressure, cut.open, gradient)
        added_mass = partial(added_mass_impulse, plain, cut, change)
    if world.setup.splits:
        own = (lambda: matrix) if mobility.is_dense else plain
        added_mass = added_mass_impulse(own, cut, change)
    return SolvedFlow(
        driven,
        v,
        actuator,
        outcome,
        left,
        viscous_impulse=viscous,
        added_mass=added_mass,
        before_pressure=smooth,
        velocity=after,
        pressure=solution.pressure / dt,
        impulse=on_solids,
        sides=pushed,
        iterations=iterations,
        sweeps=sweeps.count if sweeps else 1,
        sweep_error=sweeps.error if sweeps else 0.0,
        residual=solution.residual,
        divergence=divergence,
        fastest=fastest,
    )


def pressure_on(
    world: World, volumes: ControlVolumes, cut: Geometry, mobility: Mobility
) -> tuple[PressureGradient, PressureSystem]:
    """Gradient and matrix of the pressure: those of the last step where volumes stay."""
    if world.pressed is None or world.pressed[0] is not volumes:
        world.pressed, grid = None, world.flow()[0].grid
        gradient, yielding = gradient_on(world, cut, volumes), give_way(cut, mobility, grid)
        matrix = pressure_system(gradient, cut.open, yielding)
        if yielding.size:
            return gradient, matrix
        world.pressed = volumes, gradient, matrix
    return world.pressed[1:]


def pressure_system(
    gradient: PressureGradient, opened: Faces, reaction: Array = NO_REACTION
) -> PressureSystem:
    """K on faces of these open parts; see `PressureSystem`."""
    weights = face_weights(opened, gradient.rate, gradient.grid)
    beyond = beyond_sides(gradient.dipoles, gradient.grid.face_area * gradient.whole)
    return PressureSystem(weights, gradient.boundaries.periodic(), reaction, beyond)


def added_mass_impulse(matrix: Callable[[], PressureSystem], cut: Geometry, change: Array) -> Array:
    """(k,) impulse of the fluid on bodies whose motion (k,) changes by `change` in a step.

        -J^T K^-1 J (v+ - v)

    The pressure's impulse less this one is what it would give bodies that kept their velocities:
    with them fixed, K p^ = -(D u* + J v+), which is linear in v+.

    matrix  gives K, with a preconditioner of its own: what flesh makes room for is no part of it
    """
    system = matrix()
    rhs = np.zeros(system.shape)
    add_flux(rhs, cut, -change)
    if not rhs.any():
        return np.zeros(change.size)
    solution = system.solve(rhs, None, NO_TERM, SPLIT_TOLERANCE)
    return pressure_push(cut, solution.pressure, change.size)


def changes_under(
    pressure: Array, cut: Geometry, pose: Kinematics, driven: Driven, torque_limit: Array
) -> bool:
    """Whether `correct` changes the bodies under a pressure p^ (nx, ny, nz), Pa s."""
    size = pose.twist_jacobian.shape[0] * 6 + pose.vertices.size
    impulse = generalised(pose, pressure_push(cut, pressure, size))
    v = driven.after(impulse)
    weak = within_limits(driven, torque_limit, v, driven.actuator(v, impulse))
    return weak is not None or driven.system.updated(v) is not None


def give_way(cut: Geometry, mobility: Mobility, grid: Grid) -> Array:
    """(nx, ny, nz) volume that flesh makes room for in each cell under unit pressure there.

    The diagonal of J A^-1 J^T, estimated from what it does to cells of random signs (Bekas,
    Kokiopoulou and Saad 2007).
    """
    if mobility.is_dense:
        return NO_REACTION
    random, cells = np.random.default_rng(0), cut.rows[0]
    signs, room = np.zeros((PROBES, *grid.shape)), np.zeros(grid.shape)
    for field in signs:
        field.flat[cells] = 2.0 * random.integers(0, 2, cells.size) - 1.0
    motions = mobility.times(np.stack([pressure_push(cut, f, mobility.size) for f in signs]))
    for field, motion in zip(signs, motions, strict=True):
        moved = np.zeros(grid.shape)
        add_flux(moved, cut, motion)
        room.flat[cells] += field.flat[cells] * moved.flat[cells] / PROBES
    room.flat[cells] = np.maximum(room.flat[cells], 0.0)
    return room


def filled_pressure(pressure: Array, cut: Geometry, fluid: Fluid) -> Array:
    """(nx, ny, nz) the pressure for a viscous fluid; in cells that have opened since, what is
    around them."""
    if fluid.viscosity == 0.0:
        return pressure
    filled, wraps = pressure.copy(), np.array(fluid.grid.shape) * fluid.boundaries.periodic()
    fill_fresh(filled, cut.open, np.flatnonzero(filled == 0.0), wraps)
    return filled


def net_outflow(net: Array, velocity: Faces, cut: Geometry, rate: Array, grid: Grid) -> None:
    """Net outflow of each cell through open faces less `rate`, D u - sources, m^3/s, in `net`."""
    fields = planes(cut.open, grid), planes(velocity, grid), plane(rate, grid)
    open_outflow(plane(net, grid), *fields, grid.face_area)


def rounding_floor(velocity: Faces, cut: Geometry, moving: Array, grid: Grid) -> float:
    """Norm over all cells of what rounding leaves of the net outflow, m^3/s.

    Of fluid and bodies in motion (k,): a body that turns displaces less than its faces move.
    """
    motion, fastest = motion_of(cut, moving), 0.0
    for axis in grid.axes:
        u, opened = velocity[axis], cut.open[axis]
        met = fastest_closed(u, axis, opened, cut.closed, motion)
        fastest = max(fastest, met, largest_open(u, opened, 1.0 - ROUNDING))
    return ROUNDING * grid.face_area * fastest * sqrt(prod(grid.shape))
