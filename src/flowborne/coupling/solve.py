"""The monolithic solve: pressure, viscosity, bodies, joints and contact in one system.

Eq. (9) of the paper with the bodies eliminated is symmetric positive definite in p^ = p dt
(Robinson-Mosher, Schroeder and Fedkiw 2011):

    ( K + J A^-1 J^T ) p^ = -( D u* + J v* )
    u+ = u* - (1/rho) G p^          v+ = v* + A^-1 J^T p^

A^-1 has the prescribed dofs projected out; active contact rows and joint limits are part of A. When
the solution opens a contact that was taken as pressed, or the other way round, asks a drive for
more than its torque limit, or moves the bodies otherwise than their Coriolis forces were made for,
the system is solved again with that changed. Viscosity is solved again for new contacts only: what
the others change is small in dt.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flowborne.coupling.flow import source_rate
from flowborne.coupling.fractions import Geometry
from flowborne.coupling.friction import diffuse
from flowborne.coupling.mouths import Jet, add_rates
from flowborne.coupling.operators import (
    add_flux,
    generalised,
    motion,
    pressure_push,
    response,
)
from flowborne.coupling.report import Outcome
from flowborne.coupling.stopwatch import Stopwatch
from flowborne.coupling.world import Fluid, World
from flowborne.fluid.arrays import Integers
from flowborne.fluid.grid import Array, Faces, Grid
from flowborne.fluid.pressure import NO_REACTION, Coupling, PressureSystem
from flowborne.fluid.projection import face_weights, outflow, push
from flowborne.fluid.response import Response
from flowborne.solids.dynamics import Kinematics
from flowborne.solids.prescribed import Driven, within_limits

PASSES = 50
"""Most times that contacts, torque limits and Coriolis forces are corrected in one step."""

PROBES = 4
"""Fields of random signs by which the yielding of flesh is estimated."""

ROUNDING = 1e-15
"""Relative size of velocities that count as rounding errors in the divergence."""


@dataclass(frozen=True)
class Projected:
    """What the pressure solve gave.

    velocity    Faces u+, m/s
    pressure    (nx, ny, nz) p, Pa
    impulse     (k,) J^T p^: wrenches about the world origin, then forces on vertices of flesh, N s
                and N m s
    iterations  of the solve, all turns of a step together in the end
    residual    true relative residual
    divergence  largest |net outflow of a cell| / volume, 1/s
    fastest     largest |u+| on an open face, m/s
    """

    velocity: Faces
    pressure: Array
    impulse: Array
    iterations: int
    residual: float
    converged: bool
    divergence: float
    fastest: float


@dataclass(frozen=True)
class Solved:
    """The world's velocities at the end of a step, and what led to them.

    driven            the bodies' system in its last form
    v, actuator       (nv,) velocity and forces of the drives
    viscous_impulse   (k,) as in `Projected`
    before_pressure   Faces, m/s; None without a fluid
    projected         None without a fluid
    outcome           DONE, or which solve missed its tolerance, or that contacts, limits or
                      Coriolis forces did not settle
    unsettled         (k,) dofs as in `StepReport`
    """

    driven: Driven
    v: Array
    actuator: Array
    viscous_impulse: Array
    before_pressure: Faces | None
    projected: Projected | None
    outcome: Outcome
    unsettled: Integers


def correct(driven: Driven, v: Array, actuator: Array, limit: Array) -> Driven | None:
    """The bodies' system with the contacts and drives that the solution implies; None if it has
    them."""
    later = driven.updated(v)
    return within_limits(later or driven, limit, v, actuator) or later


def unsettled(driven: Driven, changed: Driven | None, v: Array) -> Integers:
    """(k,) dofs whose contacts, joint limits or drives `v` (nv,) asks to change."""
    if changed is None:
        return np.zeros(0, np.int64)
    system = driven.system
    wrong = (driven.prescribed != changed.prescribed) | (driven.limited != changed.limited)
    if system.rows is not None:
        zones = system.rows.zones((v - system.v) / system.dt, system.zones)
        wrong |= np.any(system.rows.J[zones != system.zones] != 0.0, axis=0)
    return np.flatnonzero(wrong)


def solve_bodies(driven: Driven, torque_limit: Array, size: int) -> Solved:
    """Bodies without a fluid; k is `size`."""
    none = np.zeros(driven.velocity.size)
    for _ in range(PASSES):
        actuator = driven.actuator(driven.velocity, none)
        changed = correct(driven, driven.velocity, actuator, torque_limit)
        left = unsettled(driven, changed, driven.velocity)
        if changed is None:
            break
        driven = changed
    outcome = Outcome.DONE if changed is None else Outcome.NOT_SETTLED
    return Solved(driven, driven.velocity, actuator, np.zeros(size), None, None, outcome, left)


def solve_together(
    world: World,
    velocity: Faces,
    driven: Driven,
    pose: Kinematics,
    cut: Geometry,
    jets: tuple[Jet, ...],
    torque_limit: Array,
    dt: float,
    watch: Stopwatch,
) -> Solved:
    """Viscosity, pressure and bodies at the end of the step (section 6, item 6).

    velocity  Faces u*, m/s, after advection and forces
    jets      of the mouths at the end of the step
    returns   velocity without divergence on the open parts of the faces, the bodies' velocity
              with driven dofs exactly at their targets, and what each gave to the other
    """
    fluid, state = world.flow()
    weights = face_weights(cut.open, fluid.grid, fluid.boundaries, fluid.density)
    mobility = response(pose, driven)
    yielding = give_way(cut, mobility, fluid.grid)
    matrix = PressureSystem(weights, fluid.boundaries.periodic(), reaction=yielding)
    pressure = dt * state.pressure
    rate = source_rate(fluid, world.time + dt, cut.open)
    add_rates(rate, jets)
    watch.lap("projection")
    smooth, viscous, smoothed = diffuse(world, velocity, cut, jets, pose, driven, dt)
    watch.lap("viscosity")
    iterations = 0
    for _ in range(PASSES):
        start = motion(pose, driven.after(generalised(pose, viscous)))
        projected = project(world, matrix, smooth, cut, rate, start, mobility, pressure, dt)
        watch.lap("projection")
        iterations += projected.iterations
        impulse = generalised(pose, viscous + projected.impulse)
        v = driven.after(impulse)
        actuator = driven.actuator(v, impulse)
        changed = correct(driven, v, actuator, torque_limit)
        left = unsettled(driven, changed, v)
        if changed is None:
            break
        if not changed.answers_as(driven):
            mobility = response(pose, changed)
            smooth, viscous, smoothed = diffuse(world, velocity, cut, jets, pose, changed, dt)
            watch.lap("viscosity")
        driven, pressure = changed, dt * projected.pressure
    outcome = Outcome.DONE if changed is None else Outcome.NOT_SETTLED
    if not smoothed:
        outcome = Outcome.VISCOSITY_NOT_CONVERGED
    if not projected.converged:
        outcome = Outcome.PRESSURE_NOT_CONVERGED
    projected = replace(projected, iterations=iterations)
    return Solved(driven, v, actuator, viscous, smooth, projected, outcome, left)


def give_way(cut: Geometry, mobility: Response, grid: Grid) -> Array:
    """(nx, ny, nz) volume that flesh makes room for in each cell under unit pressure there.

    The diagonal of J A^-1 J^T, estimated from what it does to cells of random signs (Bekas,
    Kokiopoulou and Saad 2007).
    """
    if mobility.is_dense:
        return NO_REACTION
    room, random = np.zeros(grid.shape), np.random.default_rng(0)
    for _ in range(PROBES):
        signs = random.choice([-1.0, 1.0], size=grid.shape)
        moved = np.zeros(grid.shape)
        add_flux(moved, cut, mobility.times(pressure_push(cut, signs, mobility.size)))
        room += signs * moved / PROBES
    return np.maximum(room, 0.0)


def excess(velocity: Faces, cut: Geometry, moving: Array, rate: Array, fluid: Fluid) -> Array:
    """(nx, ny, nz) net outflow of each cell, D u + J v - sources, m^3/s."""
    area = fluid.grid.face_area
    net = np.empty(fluid.grid.shape)
    outflow(net, *velocity, *cut.open)
    net *= area
    add_flux(net, cut, moving)
    net -= rate
    return net


def project(
    world: World,
    matrix: PressureSystem,
    velocity: Faces,
    cut: Geometry,
    rate: Array,
    moving: Array,
    mobility: Response,
    pressure: Array,
    dt: float,
) -> Projected:
    """Make the flow free of divergence, with the bodies answering (eq. 9).

    matrix    K for this cut
    rate      (nx, ny, nz) volume that sources and mouths bring into each cell, m^3/s
    moving    (k,) motion of the bodies before the pressure acts
    mobility  motion that a unit impulse gives
    pressure  (nx, ny, nz) first guess of p^, Pa s
    """
    fluid, _ = world.flow()
    grid = fluid.grid
    need = -excess(velocity, cut, moving, rate, fluid)
    fastest = max(float(np.abs(u).max()) for u in velocity)
    floor = ROUNDING * grid.face_area * fastest * np.sqrt(need.size)
    coupling = Coupling(cut.cells, cut.row_start, cut.columns, cut.values, mobility)
    solution = matrix.solve(need, pressure, coupling, fluid.tolerance, floor)
    after = velocity[0].copy(), velocity[1].copy(), velocity[2].copy()
    scale = 1.0 / (fluid.density * grid.spacing)
    push(after, cut.open, solution.pressure, grid, fluid.boundaries, scale)
    impulse = pressure_push(cut, solution.pressure, moving.size)
    moved = moving + mobility.times(impulse)
    left = excess(after, cut, moved, rate, fluid)
    return Projected(
        after,
        solution.pressure / dt,
        impulse,
        solution.iterations,
        solution.residual,
        solution.converged,
        float(np.abs(left).max()) / grid.cell_volume,
        max(largest_speed(after[axis], cut.open[axis]) for axis in grid.axes),
    )


def largest_speed(velocity: Array, opened: Array) -> float:
    """Largest |velocity|, m/s, on the faces across an axis that are not wholly closed."""
    return float(np.abs(velocity).max(where=opened > 0.0, initial=0.0))
