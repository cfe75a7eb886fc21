"""What a frame of a simulation did, and the state after it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from flowborne.base.one_line import one_line
from flowborne.base.phrases import listed
from flowborne.coupling.report import StepReport
from flowborne.coupling.world import World
from flowborne.kernels.arrays import Array
from flowborne.solids.sensed import Sensed

PARTS = ("advection", "viscosity", "projection", "geometry", "solids", "control")
"""Where the time of a frame goes."""


@dataclass(frozen=True, eq=False)
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
    controls   (nu,) of the model's actuators, 0 for those that were told nothing
    values     dotted key -> value that differs from the scene's, see [[changes]]
    """

    __repr__ = one_line

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
    controls: Array = field(default_factory=partial(np.zeros, 0))
    values: dict[str, Any] = field(default_factory=dict)

    @property
    def step(self) -> StepReport:
        """Report of the last step."""
        return self.steps[-1]

    def mean(self, of: Callable[[StepReport], Array]) -> Array:
        """Mean over the frame of a force of each step: its impulse over the frame's time."""
        time = sum(step.dt for step in self.steps)
        return np.asarray(sum(step.dt * of(step) for step in self.steps) / time)

    def applied(self) -> Array:
        """(nbody, 6) mean force and torque from outside on the bodies about their centres of mass,
        N and N m; those of fluid and winds are not among them."""
        return self.mean(StepReport.central_applied)

    def power(self) -> Array:
        """(nv,) mean power of the drives, W."""
        return self.mean(lambda step: step.actuator * step.velocity)

    def sensed(self, world: World) -> Sensed:
        """What can be sensed of the bodies and joints of `world` after the frame: forces on bodies
        are means over it, all else is of its last step."""
        return replace(
            self.step.sensed(world),
            wrench=self.mean(StepReport.central_wrench),
            added_mass=self.central_added_mass,
        )

    def central_added_mass(self) -> Array:
        """(nbody, 6) mean of the part of the wrenches that resists the bodies' acceleration. Raises
        ValueError when the first call is after the next frame."""
        return self.mean(StepReport.central_added_mass)

    def drag(self) -> Array:
        """(nbody, 3) mean force of fluid and winds on bodies that keep their velocities, N; see
        `central_added_mass`."""
        return (self.mean(StepReport.central_wrench) - self.central_added_mass())[:, :3]


@dataclass(frozen=True, eq=False)
class Snapshot:
    """The state after some frames.

    report  of the last one; None before the first, and after a checkpoint
    kept    what a checkpoint says of bodies and joints
    """

    __repr__ = one_line

    world: World
    frame: int
    report: FrameReport | None
    kept: Sensed | None = None

    def unlike(self, other: Snapshot) -> str:
        """Why one cannot go on as the other, in words; "" where it can."""
        own, wanted = _made_of(self.world), _made_of(other.world)
        unlike = (key for key in own if own[key] != wanted[key])
        return next((f"its {key} are {own[key]}, not {wanted[key]}" for key in unlike), "")

    @cached_property
    def sensed(self) -> Sensed:
        """Bodies and joints by their names."""
        if self.report is not None:
            return self.report.sensed(self.world)
        return self.kept or Sensed.before_steps(self.world.setup.solid, self.world.solid.q)


def _made_of(world: World) -> dict[str, str]:
    """What all states of a scene have in common, in words."""
    model, fluid = world.setup.solid, world.setup.fluid
    names = {"joints": model.joint_names, "bodies": model.body_names[1:]}
    found = {key: listed(known) or "none" for key, known in names.items()}
    if fluid is None:
        return found | {"cells": "none", "dyes": "none"}
    cells = f"{' x '.join(map(str, fluid.grid.shape))} of {fluid.grid.spacing:.6g} m"
    return found | {"cells": cells, "dyes": listed(fluid.scalars) or "none"}
