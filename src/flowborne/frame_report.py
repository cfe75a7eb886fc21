"""What a frame of a simulation did."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flowborne.coupling.report import StepReport

Array = NDArray[np.float64]

PARTS = ("advection", "viscosity", "projection", "geometry", "solids", "control")
"""Where the time of a frame goes."""


@dataclass(frozen=True)
class FrameReport:
    """What a frame did.

    frame      counted from 1
    time       at its end, s
    steps      reports of its steps, in order
    objective  the controller's objective after it (weighted sum); nan without a controller
    terms      name -> value of each term of the objective
    tried      the objective in the last decision's trials: as the hypothesis has it, at rest where
               that removes velocities; nan without a controller
    gradient   (n,) of the last decision, objective per rad or m; empty without a controller
    targets    (n,) where the controlled dofs are going, rad or m; nan for ball joints
    decided    whether the controller decided anew in this frame
    seconds    by part (`PARTS`) and "total"
    """

    frame: int
    time: float
    steps: tuple[StepReport, ...]
    objective: float
    terms: dict[str, float]
    tried: float
    gradient: Array
    targets: Array
    decided: bool
    seconds: dict[str, float]

    @property
    def step(self) -> StepReport:
        """Report of the last step."""
        return self.steps[-1]
