"""Force, torque, velocity and place of single bodies, for the history.

All of them hold at the end of the frame. The force is that of its last step, which changes the
velocity from half a step before that instant to half a step after it; the velocity is the mean of
both. Read half a step off, a force in phase with an acceleration seems to damp.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from flowborne.coupling.report import StepReport
from flowborne.solids.dynamics import kinematics
from flowborne.solids.model import SolidModel

Array = NDArray[np.float64]

UNITS = {
    "centre": "m",
    "velocity": "m/s",
    "rotation": "rad/s",
    "force": "N",
    "torque": "Nm",
}
"""Quantity -> its unit; a torque is about the centre of mass."""


class BodyMeasures:
    """What a history says of the bodies that a scene names.

    columns  <body>_<quantity>_<axis>_<unit>, in the order in which they are written
    """

    def __init__(self, model: SolidModel, names: tuple[str, ...]) -> None:
        self._model = model
        self._bodies = {name: model.body(name) for name in names}
        self.columns = tuple(
            f"{name}_{quantity}_{axis}_{unit}"
            for name in names
            for quantity, unit in UNITS.items()
            for axis in "xyz"
        )

    def values(self, q: Array, report: StepReport | None) -> dict[str, float]:
        """column -> number, at positions q (nq,) which the step of `report` led to; nan where only
        a step can tell."""
        if not self._bodies:
            return {}
        numbers = np.concatenate([part for parts in self._vectors(q, report) for part in parts])
        return dict(zip(self.columns, numbers.tolist(), strict=True))

    def _vectors(self, q: Array, report: StepReport | None) -> Iterator[tuple[Array, ...]]:
        """(3,) of every quantity of each body."""
        pose = kinematics(self._model, q)
        unknown = np.full(3, np.nan)
        for body in self._bodies.values():
            centre = pose.mass_centre[body]
            if report is None:
                yield centre, unknown, unknown, unknown, unknown
                continue
            twist = pose.twist_jacobian[body] @ report.velocity
            force, torque = np.split(report.fluid_wrench()[body], 2)
            velocity = twist[:3] + np.cross(twist[3:], centre)
            yield centre, velocity, twist[3:], force, torque - np.cross(centre, force)
