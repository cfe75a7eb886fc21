"""How prescribed motions and outside commands drive the joints in a step."""

from __future__ import annotations

import numpy as np

from flowborne.coupling.world import World
from flowborne.kernels.arrays import Array
from flowborne.solids.trajectories import JointCommand, Trajectory, TrajectoryServo, velocity_after


def joint_command(world: World, dt: float, command: JointCommand | None) -> JointCommand:
    """The command with prescribed motions, what joints are told, and a slab's locked dofs added.

    A drive that follows a motion exactly ends the step with the velocity of half a step later, as
    the dofs that answer forces do (leapfrog). A trial keeps to the half step of the world itself,
    so that its velocities change over just its step. A servo moves its dofs with the velocity that
    they have: its torque limit may prevent another one, and it steers the step after.
    """
    model, end = world.setup.solid, world.time + dt
    command = JointCommand.none(model.nv) if command is None else command.copy()
    told = world.told
    for motion in (*world.setup.motions, *told.motions):
        if isinstance(motion, TrajectoryServo):
            v = world.solid.v[motion.dofs]
            gap = gap_to(world, motion, end + dt) - dt * v
            final_velocity, _ = motion.servo.velocity(gap, v, dt, dt)
            limit = np.asarray(motion.servo.torque_limit, dtype=np.float64)
            command.set(motion.dofs, v, final_velocity, limit)
        else:
            rate, span = gap_to(world, motion, end) / dt, 2.0 * world.ahead
            if span > 0.0:
                final_velocity = velocity_after(model, world.solid.q, motion, end, span)
            else:
                final_velocity = motion.velocity(end)
            command.set(motion.dofs, rate, final_velocity)
    command.prescribed[told.pushed] = False
    if model.locked.any():
        command.set(model.locked, 0.0, 0.0)
    return command


def gap_to(world: World, motion: Trajectory, time: float) -> Array:
    """(k,) displacement of a motion's dofs from their positions to its own at `time` (s)."""
    model, goal = world.setup.solid, world.solid.q.copy()
    goal[model.indices_of(motion.dofs)] = motion.position(time)
    return model.difference(world.solid.q, goal)[motion.dofs]
