"""How the drives take the joints to their targets: exactly, or by a critically damped PD law.

The PD law is solved analytically, as in Weinstein, Guendelman and Fedkiw 2008, "Impulse-based
control of joints and muscles", which the paper uses.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from flowborne.coupling.motion import Trajectory

Array = NDArray[np.float64]


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
    """A prescribed motion whose dofs are taken to it by a servo: late, or with limited force.

    trajectory  what the dofs are told, and where they start
    servo       how their drives follow
    """

    trajectory: Trajectory
    servo: Servo

    @property
    def dofs(self) -> NDArray[np.int64]:
        return self.trajectory.dofs

    def position(self, time: float) -> Array:
        """(m,) rad, m, unit quaternions that the dofs are told."""
        return self.trajectory.position(time)

    def velocity(self, time: float) -> Array:
        """(k,) rad/s or m/s that the dofs are told."""
        return self.trajectory.velocity(time)
