"""Prescribed motions, the servos that follow them, and what drives the joints in a step.

A servo takes joints to their targets exactly, or by a critically damped PD law, which is solved
analytically, as in Weinstein, Guendelman and Fedkiw 2008, "Impulse-based control of joints and
muscles", which the paper uses.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from flowborne.kernels.arrays import Array, Integers, Mask
from flowborne.solids.force import Force
from flowborne.solids.model import SolidModel
from flowborne.solids.motors import Controls


class Trajectory(Protocol):
    """A prescribed motion of some dofs, known for all time.

    dofs  (k,) indices into v, ascending: all dofs of each of its joints
    """

    @property
    def dofs(self) -> Integers: ...

    def position(self, time: float) -> Array:
        """(m,) the joints' entries of q at `time` (s): rad, m, unit quaternions."""
        ...

    def velocity(self, time: float) -> Array:
        """(k,) their entries of v, rad/s or m/s: the derivative of the positions."""
        ...


def velocity_after(
    model: SolidModel, q: Array, motion: Trajectory, time: float, dt: float
) -> Array:
    """(k,) velocity with which a motion goes on for a step after `time` (s).

    In leapfrog the velocities at an instant are those of half a step on, which the bodies then move
    with; given to driven dofs as it is to free ones, what they exchange is of second order in time.

    q  (nq,) a pose whose other joints do not matter
    """
    here, there = q.copy(), q.copy()
    indices = model.indices_of(motion.dofs)
    here[indices], there[indices] = motion.position(time), motion.position(time + dt)
    return model.difference(here, there)[motion.dofs] / dt


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


@dataclass
class JointCommand:
    """Which dofs are driven in a step and how; arrays over all nv dofs.

    prescribed      (nv,) bool
    rate            (nv,) velocity with which a driven dof moves during the step
    final_velocity  (nv,) velocity that a driven dof has at the end of the step
    torque_limit    (nv,) largest |generalised force| the drive may use; inf keeps the promise
    """

    prescribed: Mask
    rate: Array
    final_velocity: Array
    torque_limit: Array

    @classmethod
    def none(cls, nv: int) -> JointCommand:
        """Leaves every dof free."""
        return cls(np.zeros(nv, bool), np.zeros(nv), np.zeros(nv), np.full(nv, np.inf))

    def copy(self) -> JointCommand:
        return JointCommand(*(values.copy() for values in vars(self).values()))

    def set(
        self,
        dofs: Integers | Mask,
        rate: Array | float,
        final_velocity: Array | float,
        torque_limit: Array | float = np.inf,
    ) -> None:
        """Drive `dofs`, indices (k,) or a mask (nv,), with these velocities."""
        self.prescribed[dofs] = True
        self.rate[dofs] = rate
        self.final_velocity[dofs] = final_velocity
        self.torque_limit[dofs] = torque_limit


@dataclass(frozen=True, eq=False)
class TrajectoryKnots:
    """Joints that go from pose to pose at even velocities and are in each at its time.

    dofs   (k,) of the joints
    times  (n,) s, ascending; n at least 2
    poses  (n, nq), whose other joints do not matter
    """

    model: SolidModel
    dofs: Integers
    times: Array
    poses: Array

    def position(self, time: float) -> Array:
        """(m,) entries of q; beyond both ends the joints keep their velocity."""
        knot = self._knot(time)
        pose = self.poses[knot]
        if time != self.times[knot]:
            pose = self.model.integrate(pose, self._velocity(knot), time - self.times[knot])
        return pose[self.model.indices_of(self.dofs)]

    def velocity(self, time: float) -> Array:
        """(k,) entries of v."""
        return self._velocity(self._knot(time))[self.dofs]

    def _knot(self, time: float) -> int:
        """The last one at or before `time`."""
        before = int(np.searchsorted(self.times, time, side="right")) - 1
        return min(max(before, 0), len(self.times) - 1)

    def _velocity(self, knot: int) -> Array:
        """(nv,) after a knot."""
        knot = min(knot, len(self.times) - 2)
        here, there = self.poses[knot : knot + 2]
        return self.model.difference(here, there) / (self.times[knot + 1] - self.times[knot])


@dataclass(frozen=True, eq=False)
class Told:
    """What joints are told from outside. Neither the scene's motions nor its controller moves them.

    motions   to their targets
    pushed    (k,) dofs that a force drives
    force     (k,) N m or N
    controls  of actuators, None where none has one
    servos    actuators that drive a joint as its servo, and its dof
    forces    on bodies, besides those of the setup
    settings  of thrusters by name, in place of their own
    """

    motions: tuple[Trajectory, ...]
    pushed: Integers
    force: Array
    controls: Controls | None = None
    servos: Sequence[tuple[int, int]] = ()
    forces: tuple[Force, ...] = ()
    settings: Mapping[str, float] = field(default_factory=dict)

    def force_on(self, nv: int) -> Array:
        """(nv,) generalised force."""
        force = np.zeros(nv)
        force[self.pushed] = self.force
        return force

    def dofs(self) -> Integers:
        """All that are told."""
        return np.concatenate([self.pushed, *(motion.dofs for motion in self.motions)])


NOTHING_TOLD = Told((), np.zeros(0, np.int64), np.zeros(0))
