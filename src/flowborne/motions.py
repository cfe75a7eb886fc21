"""Joints that are told how to move, and how their drives follow."""

from __future__ import annotations

from flowborne.coupling.motion import JointCommand, Trajectory
from flowborne.coupling.servo import Servo, ServoExact, ServoPD, TrajectoryServo
from flowborne.motion.tracks import (
    Curve,
    TrajectoryConstant,
    TrajectoryFormula,
    TrajectoryKeyframes,
    TrajectorySinusoid,
)

__all__ = [
    "Curve",
    "JointCommand",
    "Servo",
    "ServoExact",
    "ServoPD",
    "Trajectory",
    "TrajectoryConstant",
    "TrajectoryFormula",
    "TrajectoryKeyframes",
    "TrajectoryServo",
    "TrajectorySinusoid",
]
