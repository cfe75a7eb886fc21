"""How the drives take the joints to their targets: exactly, or by a critically damped PD law.

The PD law is solved analytically, as in Weinstein, Guendelman and Fedkiw 2008, "Impulse-based
control of joints and muscles", which the paper uses.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from flowborne.coupling.motion import JointCommand, Trajectory, velocity_after
from flowborne.kernels.arrays import Array, Integers

if TYPE_CHECKING:
    from flowborne.coupling.world import World


class Servo(Protocol):
    """Shapes the velocity of the driven dofs.

    torque_limit  N m or N, the largest force of a drive; one for all dofs or one each
    """

    @property
    def torque_limit(self) -> float | tuple[float, ...]: ...

    def velocity(
        self, gap: Array, velocity: Array, remaining: float, dt: float
    ) -> tuple[Array, Array]:
        """Velocity to move with during a step and velocity to have at its end.

        gap        (n,) displacement from here to the target, rad or m
        velocity   (n,) present velocities
        remaining  s until the target is due, at least dt
        dt         s, length of the step
        """
        ...


def check_torque_limit(limit: float | tuple[float, ...]) -> None:
    """Raise ValueError unless every limit is positive (infinity allowed)."""
    if not np.all(np.asarray(limit, dtype=np.float64) > 0.0):
        raise ValueError(f"torque limit is {limit}: give positive numbers in N m (or N)")


@dataclass(frozen=True)
class ServoExact:
    """Constant rate, so that the target is reached exactly when it is due.

    raises  ValueError for a torque limit that is not positive
    """

    torque_limit: float | tuple[float, ...] = np.inf

    def __post_init__(self) -> None:
        check_torque_limit(self.torque_limit)

    def velocity(
        self, gap: Array, velocity: Array, remaining: float, dt: float
    ) -> tuple[Array, Array]:
        rate = gap / remaining
        return rate, rate


@dataclass(frozen=True)
class ServoPD:
    """Critically damped approach: acceleration = w^2 gap - 2 w velocity.

    The law is integrated exactly over the step, so it is stable for any w and dt and approaches
    the target without overshoot from rest.

    frequency  w in rad/s: after 1/w s from rest 74 % of the gap is left, after 5/w s 4 %
    raises     ValueError for a frequency or torque limit that is not positive
    """

    frequency: float
    torque_limit: float | tuple[float, ...] = np.inf

    def __post_init__(self) -> None:
        if not 0.0 < self.frequency < np.inf:
            raise ValueError(f"servo frequency is {self.frequency}: give a positive number, rad/s")
        check_torque_limit(self.torque_limit)

    def velocity(
        self, gap: Array, velocity: Array, remaining: float, dt: float
    ) -> tuple[Array, Array]:
        w = self.frequency
        x, slope = -gap, velocity - w * gap
        decay = np.exp(-w * dt)
        after = (x + slope * dt) * decay
        return (after - x) / dt, (slope - w * (x + slope * dt)) * decay


@dataclass(frozen=True)
class TrajectoryServo:
    """A prescribed motion that a servo follows: late, or with limited force.

    trajectory  the prescribed motion, and where it starts
    servo       how their drives follow
    """

    trajectory: Trajectory
    servo: Servo

    @property
    def dofs(self) -> Integers:
        return self.trajectory.dofs

    def position(self, time: float) -> Array:
        """(m,) rad, m, unit quaternions of the prescribed motion."""
        return self.trajectory.position(time)

    def velocity(self, time: float) -> Array:
        """(k,) rad/s or m/s of the prescribed motion."""
        return self.trajectory.velocity(time)


def driven(motion: Trajectory, servo: Servo) -> Trajectory:
    """The motion as a servo follows it; itself where the servo keeps every promise."""
    exact = isinstance(servo, ServoExact) and bool(np.all(np.isinf(servo.torque_limit)))
    return motion if exact else TrajectoryServo(motion, servo)


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
            final_velocity = motion.velocity(end)
            if span > 0.0:
                final_velocity = velocity_after(model, world.solid.q, motion, end, span)
            command.set(motion.dofs, rate, final_velocity)
    command.prescribed[told.pushed] = False
    command.set(model.locked, 0.0, 0.0)
    return command


def gap_to(world: World, motion: Trajectory, time: float) -> Array:
    """(k,) displacement of a motion's dofs from their positions to its own at `time` (s)."""
    model, goal = world.setup.solid, world.solid.q.copy()
    goal[model.indices_of(motion.dofs)] = motion.position(time)
    return model.difference(world.solid.q, goal)[motion.dofs]
