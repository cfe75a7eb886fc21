"""Force, torque, velocity and place of single bodies, for the history, all at the frame's end."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flowborne.coupling.named import BodyState, Named
from flowborne.coupling.report import StepReport
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
        self._model, self._names = model, names
        self.columns = tuple(
            f"{name}_{quantity}_{axis}_{unit}"
            for name in names
            for quantity, unit in UNITS.items()
            for axis in "xyz"
        )

    def values(self, q: Array, report: StepReport | None) -> dict[str, float]:
        """column -> number, at positions q (nq,) which the step of `report` led to; nan where only
        a step can tell."""
        named = Named(self._model, q, report)
        numbers = [x for name in self._names for x in _numbers(named.body(name))]
        return dict(zip(self.columns, numbers, strict=True))


def _numbers(body: BodyState) -> list[float]:
    """Every quantity of UNITS, in its order."""
    parts = (body.centre, body.velocity, body.angular_velocity, body.force, body.torque)
    found: list[float] = np.concatenate(parts).tolist()
    return found
