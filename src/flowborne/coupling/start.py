"""The velocities that bodies and fluid have together when they start."""

from __future__ import annotations

import numpy as np

from flowborne.base.errors import BreakdownError
from flowborne.coupling.bodies_step import parts_of, position_velocity
from flowborne.coupling.drives import joint_command
from flowborne.coupling.report import Outcome
from flowborne.coupling.step import step_part
from flowborne.coupling.world import World
from flowborne.kernels.arrays import Mask
from flowborne.solids.trajectories import JointCommand

INSTANT = 1e-9
"""s of the step in which only impulses act."""


def start(
    world: World, dt: float, given: Mask | None = None, command: JointCommand | None = None
) -> None:
    """Take the velocities of the start to the middle of the first step, in place.

    A step of leapfrog moves bodies with the velocity of its middle. Were that of the start taken
    for it, times would be half a step off, and a creature whose joints begin to move would keep
    the impulse that half a step of their drives gives it. So the fluid is set going with the bodies
    (`set_going`) where they were half a step before, and half a step under all forces brings them
    here.

    dt       s, of the steps to come
    given    as in `set_going`
    command  to joints without a trajectory
    raises   BreakdownError when the flow cannot be solved for, or the half step fails
    """
    setup, time = world.setup, world.time
    told = joint_command(world, dt, command)
    world.parts = parts_of(world, position_velocity(world, told), dt)
    half = 0.5 * dt / world.parts
    if world.fluid is not None:
        set_going(world, given)
    if world.solid.v.any():
        world.solid.q[:] = setup.solid.integrate(world.solid.q, world.solid.v, -half)
        if world.fluid is not None:
            set_going(world)
    world.time, world.ahead = time - half, half
    command = joint_command(world, half, command)
    world.time, world.setup = time, setup.but(motions=())
    scalars = {} if world.fluid is None else world.fluid.scalars
    report = step_part(world, half, command)
    if report.outcome is not Outcome.DONE:
        raise BreakdownError(f"the first half of a step failed: {report.outcome.value}")
    if world.fluid is not None:
        world.fluid.scalars = scalars
    world.setup, world.time, world.steps, world.ahead = setup, time, 0, half


def set_going(world: World, given: Mask | None = None) -> None:
    """Set the fluid going with its bodies, as by an impulse at the start, in place.

    The velocity of the fluid becomes that with the same circulation that flows around the moving
    bodies: potential flow, where it was at rest or uniform. Without it the fluid takes its share
    of the bodies' velocity in the first step, and the pressure of that step is an impulse.

    given   (nv,) dofs that keep their velocity; the others get that at which no impulse acts on
            them and their share of the fluid from outside. All when None
    raises  BreakdownError when the flow cannot be solved for
    """
    fluid, state = world.flow()
    if fluid.one_way:
        return
    there = world.for_step()
    there.setup = world.setup.but(motions=(), winds=(), forces=(), thrusters=())
    command = JointCommand.none(there.solid.v.size)
    kept = np.ones(there.solid.v.size, bool) if given is None else given
    command.set(kept, 0.0, there.solid.v[kept])
    there.solid.v[:] = 0.0
    report = step_part(there, INSTANT, command)
    if report.outcome is not Outcome.DONE:
        raise BreakdownError(f"the flow at the start was not found: {report.outcome.value}")
    _, found = there.flow()
    world.solid.v[:] = there.solid.v
    state.velocity = found.velocity
    for values in state.velocity_change:
        values[:] = 0.0
    world.cut = there.cut
