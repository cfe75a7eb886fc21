"""What the cases' worlds have in common."""

from __future__ import annotations

import numpy as np

from flowborne import StepReport, World
from flowborne.boundaries import Boundaries, BoundaryPeriodic
from flowborne.worlds import advance

Vector = tuple[float, float, float]

NOWHERE: Vector = (0.0, 0.0, 0.0)
PERIODIC = BoundaryPeriodic()
RING = Boundaries(PERIODIC, PERIODIC, PERIODIC, PERIODIC)
"""Periodic in x and y."""


def mjcf(*elements: str, options: str = "") -> str:
    """An MJCF model of world-body elements; angles in radians, no contact."""
    return (
        '<mujoco><compiler angle="radian"/><default><geom contype="0" conaffinity="0"/></default>'
        f"{options}<worldbody>{''.join(elements)}</worldbody></mujoco>"
    )


def start_at_once(world: World, dt: float) -> StepReport:
    """One step from a flow that does not yet know its bodies: the impulsive start.

    The pressure of this step is an impulse, which says nothing about the next step: it is cleared.
    """
    report = advance(world, dt)
    _, state = world.flow()
    for values in (*state.acceleration, state.pressure, state.earlier):
        values[:] = 0.0
    return report


def whole_steps(duration: float, longest: float) -> tuple[int, float]:
    """Number and length of equal steps, none longer than `longest`, that make up a duration."""
    count = max(1, int(np.ceil(duration / longest - 1e-9)))
    return count, duration / count
