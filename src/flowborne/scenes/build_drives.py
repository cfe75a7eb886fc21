"""The servos of a scene."""

from __future__ import annotations

import math

import numpy as np

from flowborne.coupling.motion import Trajectory
from flowborne.coupling.servo import Servo, ServoExact, ServoPD, TrajectoryServo
from flowborne.scenes import schema_drives as tables


def servo_of(table: tables.ServoExact | tables.ServoPD, limit: float | tuple[float, ...]) -> Servo:
    """A servo whose drives have at most `limit`, N m or N; one for all dofs or one each."""
    if isinstance(table, tables.ServoExact):
        return ServoExact(limit)
    return ServoPD(2.0 * math.pi * table.frequency, limit)


def driven(motion: Trajectory, servo: Servo) -> Trajectory:
    """The motion as a servo follows it; itself where the servo keeps every promise."""
    exact = isinstance(servo, ServoExact) and bool(np.all(np.isinf(servo.torque_limit)))
    return motion if exact else TrajectoryServo(motion, servo)
