"""What a frame of a simulation did: forces as means over it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from flowborne.coupling.report import StepReport
from flowborne.fluid.grid import Array

PARTS = ("advection", "viscosity", "projection", "geometry", "solids", "control")
"""Where the time of a frame goes."""


@dataclass(frozen=True)
class FrameReport:
    """What a frame did.

    frame      counted from 1
    time       at its end, s
    steps      reports of its steps, in order
    objective  of the last decision, see `Decision`; nan without a controller
    terms      name -> value of each term of the objective in the last step, without its weight
    gradient   (n,) of the last decision, objective per rad or m; empty without a controller
    targets    (n,) where the controlled dofs are going, rad or m; nan for ball joints
    decided    whether the controller decided anew in this frame
    seconds    by part (`PARTS`) and "total"
    beyond     sentences: which limits what joints were told would have passed
    values     dotted key -> value that differs from the scene's, see [[changes]]
    """

    frame: int
    time: float
    steps: tuple[StepReport, ...]
    objective: float
    terms: dict[str, float]
    gradient: Array
    targets: Array
    decided: bool
    seconds: dict[str, float]
    beyond: tuple[str, ...] = ()
    values: dict[str, Any] = field(default_factory=dict)

    @property
    def step(self) -> StepReport:
        """Report of the last step."""
        return self.steps[-1]

    @property
    def velocity(self) -> Array:
        """(nv,) at the end of the frame."""
        return self.step.velocity

    @property
    def acceleration(self) -> Array:
        """(nv,) change of v in the last step by dt."""
        return self.step.acceleration

    @property
    def dt(self) -> float:
        """Length of the last step, s."""
        return self.step.dt

    @property
    def actuator(self) -> Array:
        """(nv,) generalised force of the drives in the last step, N or N m."""
        return self.step.actuator

    def mean(self, of: Callable[[StepReport], Array]) -> Array:
        """Mean over the frame of a force of each step: its impulse over the frame's time."""
        time = sum(step.dt for step in self.steps)
        return np.asarray(sum(step.dt * of(step) for step in self.steps) / time)

    def central_wrench(self) -> Array:
        """(nbody, 6) mean force of fluid and winds, and torque about each body's centre of mass."""
        return self.mean(StepReport.central_wrench)

    def central_added_mass(self) -> Array:
        """(nbody, 6) the part of it with which the fluid resists the bodies' acceleration."""
        return self.mean(StepReport.central_added_mass)

    def drag(self) -> Array:
        """(nbody, 3) mean force of fluid and winds on bodies that keep their velocities, N."""
        return (self.central_wrench() - self.central_added_mass())[:, :3]
