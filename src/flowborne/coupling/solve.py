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
from flowborne.coupling.mouths import Jet, add_rates, skin_slip
from flowborne.coupling.operators import (
    add_flux,
    generalised,
    pressure_wrench,
    response,
    twists,
)
from flowborne.coupling.stopwatch import Stopwatch
from flowborne.coupling.world import Fluid, World
from flowborne.fluid.grid import Array, Faces
from flowborne.fluid.pressure import Coupling, PressureSystem
from flowborne.fluid.projection import face_weights, outflow, push
from flowborne.fluid.viscosity import assemble_viscosity
from flowborne.fluid.viscous_solve import ViscousSystem, walls_of
from flowborne.solids.dynamics import Kinematics
from flowborne.solids.prescribed import PrescribedSystem, within_limits

PASSES = 50
"""Most times that contacts, torque limits and Coriolis forces are corrected in one step."""

VISCOUS_TOLERANCE = 1e-12
"""Relative residual of the viscous solve."""

ROUNDING = 1e-15
"""Relative size of velocities that count as rounding errors in the divergence."""


@dataclass(frozen=True)
class Projected:
    """What the pressure solve gave.

    velocity    Faces u+, m/s
    pressure    (nx, ny, nz) p, Pa
    impulse     (nbody, 6) J^T p^ about the world origin, N s and N m s
    iterations  of the solve, all turns of a step together in the end
    residual    true relative residual
    divergence  largest |net outflow of a cell| / volume, 1/s
    """

    velocity: Faces
    pressure: Array
    impulse: Array
    iterations: int
    residual: float
    converged: bool
    divergence: float


@dataclass(frozen=True)
class Solved:
    """The world's velocities at the end of a step, and what led to them.

    driven            the bodies' system in its last form
    v, actuator       (nv,) velocity and forces of the drives
    viscous_impulse   (nbody, 6) about the world origin
    before_pressure   Faces, m/s; None without a fluid
    projected         None without a fluid
    converged         solve within its tolerance, contacts and limits settled
    """

    driven: PrescribedSystem
    v: Array
    actuator: Array
    viscous_impulse: Array
    before_pressure: Faces | None
    projected: Projected | None
    converged: bool


def correct(
    driven: PrescribedSystem, v: Array, actuator: Array, limit: Array
) -> PrescribedSystem | None:
    """The bodies' system with the contacts and drives that the solution implies; None if it has
    them."""
    later = driven.updated(v)
    return within_limits(later or driven, limit, v, actuator) or later


def solve_bodies(driven: PrescribedSystem, torque_limit: Array, nbody: int) -> Solved:
    """Bodies without a fluid."""
    none = np.zeros(driven.velocity.size)
    for _ in range(PASSES):
        actuator = driven.actuator(driven.velocity, none)
        changed = correct(driven, driven.velocity, actuator, torque_limit)
        if changed is None:
            break
        driven = changed
    return Solved(
        driven, driven.velocity, actuator, np.zeros((nbody, 6)), None, None, changed is None
    )


def solve_together(
    world: World,
    velocity: Faces,
    driven: PrescribedSystem,
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
    matrix = PressureSystem(weights, fluid.boundaries.periodic())
    pressure = dt * state.pressure
    rate = source_rate(fluid, world.time + dt, cut.open)
    add_rates(rate, jets)
    mobility = response(pose, driven.inverse)
    watch.lap("projection")
    smooth, viscous, smoothed = diffuse(world, velocity, cut, jets, pose, driven, mobility, dt)
    watch.lap("viscosity")
    iterations = 0
    for _ in range(PASSES):
        start = twists(pose, driven.after(generalised(pose, viscous)))
        projected = project(world, matrix, smooth, cut, rate, start, mobility, pressure, dt)
        watch.lap("projection")
        iterations += projected.iterations
        impulse = generalised(pose, viscous + projected.impulse)
        v = driven.after(impulse)
        actuator = driven.actuator(v, impulse)
        changed = correct(driven, v, actuator, torque_limit)
        if changed is None:
            break
        if not np.array_equal(changed.inverse, driven.inverse):
            mobility = response(pose, changed.inverse)
            smooth, viscous, smoothed = diffuse(
                world, velocity, cut, jets, pose, changed, mobility, dt
            )
            watch.lap("viscosity")
        driven, pressure = changed, dt * projected.pressure
    settled = smoothed and projected.converged and changed is None
    projected = replace(projected, iterations=iterations)
    return Solved(driven, v, actuator, viscous, smooth, projected, settled)


def diffuse(
    world: World,
    velocity: Faces,
    cut: Geometry,
    jets: tuple[Jet, ...],
    pose: Kinematics,
    driven: PrescribedSystem,
    mobility: Array,
    dt: float,
) -> tuple[Faces, Array, bool]:
    """Implicit viscosity with the pressure of the last step, and its impulse on the bodies.

    The pressure is there so that the boundary layer is that of the flow at the end of the step;
    it is taken off again before the new pressure is solved for.

    returns  Faces; (nbody, 6) impulse about the world origin; whether the solve converged
    """
    fluid, state = world.flow()
    nbody = pose.twist_jacobian.shape[0]
    if fluid.viscosity == 0.0:
        return velocity, np.zeros((nbody, 6)), True
    grid, sides = fluid.grid, fluid.boundaries
    pushed = velocity[0].copy(), velocity[1].copy(), velocity[2].copy()
    scale = dt / (fluid.density * grid.spacing)
    push(pushed, cut.open, state.pressure, grid, sides, scale)
    earlier = pressure_wrench(cut, dt * state.pressure, nbody)
    twist = twists(pose, driven.after(generalised(pose, earlier)))
    parts = assemble_viscosity(
        cut.distance,
        cut.open,
        velocity,
        grid,
        sides,
        fluid.density,
        fluid.viscosity,
        dt,
        world.time + dt,
    )
    walls = walls_of(parts, cut.distance, cut.nearest, grid)
    system = ViscousSystem(parts, walls, mobility, grid, sides, dt)
    slip = skin_slip(jets, walls.point, walls.across, walls.body, cut, grid)
    smooth, impulse, converged = system.solve(pushed, twist.ravel(), VISCOUS_TOLERANCE, slip)
    push(smooth, cut.open, state.pressure, grid, sides, -scale)
    return smooth, impulse.reshape(nbody, 6), converged


def excess(velocity: Faces, cut: Geometry, twist: Array, rate: Array, fluid: Fluid) -> Array:
    """(nx, ny, nz) net outflow of each cell, D u + J v - sources, m^3/s."""
    area = fluid.grid.face_area
    net = np.empty(fluid.grid.shape)
    outflow(net, *velocity, *cut.open)
    net *= area
    add_flux(net, cut.cells, cut.columns, cut.values, twist)
    net -= rate
    return net


def project(
    world: World,
    matrix: PressureSystem,
    velocity: Faces,
    cut: Geometry,
    rate: Array,
    twist: Array,
    mobility: Array,
    pressure: Array,
    dt: float,
) -> Projected:
    """Make the flow free of divergence, with the bodies answering (eq. 9).

    matrix    K for this cut
    rate      (nx, ny, nz) volume that sources and mouths bring into each cell, m^3/s
    twist     (nbody, 6) of the bodies before the pressure acts
    mobility  (6 nb, 6 nb) twists that unit wrench impulses give
    pressure  (nx, ny, nz) first guess of p^, Pa s
    """
    fluid, _ = world.flow()
    grid = fluid.grid
    need = -excess(velocity, cut, twist, rate, fluid)
    fastest = max(float(np.abs(u).max()) for u in velocity)
    floor = ROUNDING * grid.face_area * fastest * np.sqrt(need.size)
    coupling = Coupling(cut.cells, cut.row_start, cut.columns, cut.values, mobility)
    solution = matrix.solve(need, pressure, coupling, fluid.tolerance, floor)
    after = velocity[0].copy(), velocity[1].copy(), velocity[2].copy()
    scale = 1.0 / (fluid.density * grid.spacing)
    push(after, cut.open, solution.pressure, grid, fluid.boundaries, scale)
    impulse = pressure_wrench(cut, solution.pressure, twist.shape[0])
    moved = twist + (mobility @ impulse.ravel()).reshape(twist.shape)
    left = excess(after, cut, moved, rate, fluid)
    return Projected(
        after,
        solution.pressure / dt,
        impulse,
        solution.iterations,
        solution.residual,
        solution.converged,
        float(np.abs(left).max()) / grid.cell_volume,
    )
