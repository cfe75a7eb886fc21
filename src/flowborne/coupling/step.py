"""One time step of the coupled world: section 6 of the paper on one page.

The items of `step_coupled`, from t^n to t^{n+1}:

    1  velocities half a step ahead, v^{n+1/2}
    2  the bodies move:  x^{n+1} = x^n + dt v^{n+1/2}
    3  the grid is cut at x^{n+1}
    4  leak-proof projection of the advecting field with (x^{n+1} - x^n) / dt
    5  advection by it, and the forces that are known
    6  viscosity, pressure, bodies, joints and contact in one solve
    7  the state at t^{n+1}

Deviations from the paper, and their reasons:

    1  Leapfrog in place of a solve for half a step: bodies already have the velocity of the middle
       of the step, so that one solve a step gives second order. Half of the last pressure acts
       here, so that pressure takes less energy from the flow (`half_pressure`).
    4  The field is that of the middle of the step, u^n + (u^n - u^{n-1}) / 2: with that of the
       start the scheme would be of first order. The projection matches the exact change of the
       cells' open volumes, which momentum and dye in flux form need (`leak_proof`).
    5  Momentum is advected in flux form: along particle paths the fluid loses a tenth of what a
       swimmer exchanges with it.
    6  Viscosity is solved for first, with friction at bodies and the last pressure
       (`viscous_solve`).

Method: docs/method/step.md.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flowborne.base.arguments import POSITIVE, one_of, or_none, takes
from flowborne.coupling.bodies_step import (
    activate,
    equations,
    move_bodies,
    part_of,
    parts_of,
    position_velocity,
    step_bodies,
)
from flowborne.coupling.cut import departure, discs_at, follow, jets_at, pose_and_cut
from flowborne.coupling.drives import joint_command
from flowborne.coupling.far_field import far_field
from flowborne.coupling.flow import (
    advect,
    apply_forces_and_sides,
    leak_proof_transport,
    store_state,
)
from flowborne.coupling.half_pressure import explicit_half_pressure
from flowborne.coupling.operators import generalised
from flowborne.coupling.report import Outcome, StepReport, joined, timed
from flowborne.coupling.solve import solve_together
from flowborne.coupling.step_report import known_forces, report_coupled, report_failed, thrust_of
from flowborne.coupling.world import World
from flowborne.kernels.faces import is_finite
from flowborne.solids.trajectories import JointCommand


@takes(
    world=one_of(World, wanted="a World"),
    dt=POSITIVE,
    command=or_none(one_of(JointCommand, wanted="a JointCommand")),
)
def step(world: World, dt: float, command: JointCommand | None = None) -> StepReport:
    """Advance `world` by dt, in place (section 6), in as many equal parts as `parts_of` asks for.

    The world's own steps keep the number once it has been raised: steps of changing length lose an
    order of accuracy.

    A grid that follows bodies moves first, but in no trial.

    command  what the controlled dofs do; the setup's prescribed motions are added to it
    returns  the report; its outcome is not DONE when the numbers cannot be trusted, and the world
             cannot be stepped on
    """
    with timed("solids") as seconds:
        came = np.zeros(3) if world.setup.trial else follow(world)
        told = joint_command(world, dt, command)
        parts = parts_of(world, position_velocity(world, told), dt)
        if not world.setup.trial:
            world.parts = parts = max(parts, world.parts)
        command = JointCommand.none(world.setup.solid.nv) if command is None else command
        reports: list[StepReport] = []
        world.splitting = ()
        for left in range(parts, 0, -1):
            activate(world, dt / parts)
            reports.append(step_part(world, dt / parts, part_of(command, world, left)))
            if reports[-1].outcome is not Outcome.DONE:
                break
        done = joined(reports)
    if came.any():
        done = replace(done, momentum_crossed=done.momentum_crossed + came)
    done.seconds.update(seconds)
    return done


def step_part(world: World, dt: float, command: JointCommand) -> StepReport:
    """Advance `world` by a part of a step, in place, that no body crosses more than a cell in."""
    if not world.setup.trial:
        world.ahead = 0.5 * dt
    take = step_bodies if world.setup.fluid is None else step_coupled
    return take(world, dt, joint_command(world, dt, command))


@timed("advection")
def step_coupled(world: World, dt: float, command: JointCommand) -> StepReport:
    """Bodies and fluid a step later, in place; the numbers are those above."""
    (fluid, state), end = world.flow(), world.time + dt
    start = departure(world)
    far = far_field(world, start, dt)
    half = explicit_half_pressure(world, start, dt)  # 1
    with timed("solids"):
        move_bodies(world, command, dt)  # 2
    pose, cut = pose_and_cut(world)  # 3
    transport = leak_proof_transport(world, start, cut, dt)  # 4
    advected, dyed = advect(world, start, half.velocity, transport)  # 5
    driven_sides = far.drive(advected, cut.open, fluid)
    volumes = advected.volumes
    discs = discs_at(world, pose, volumes, end)
    velocity = apply_forces_and_sides(driven_sides, cut.open, fluid, discs, end, dt)
    if not all(is_finite(velocity[axis]) for axis in fluid.grid.axes):
        return report_failed(world.setup, dt, Outcome.ADVECTION_NOT_FINITE)
    with timed("solids"):
        push, known = known_forces(world, pose, half.impulse, advected.jets, discs, dt)
        driven = equations(world, start.bodies, generalised(pose, push), command, dt)
    jets, limit = jets_at(world, end), command.torque_limit
    solved = solve_together(world, velocity, volumes, driven, pose, cut, jets, limit)  # 6
    store_state(world, start, half, advected, dyed, solved, cut, pose)  # 7
    state.wake, state.sea = far.wake, far.velocity
    known |= thrust_of(discs, solved, pose) | {"dye_budget_error": dyed.error}
    return report_coupled(world, dt, pose, half, driven_sides, solved, known)
