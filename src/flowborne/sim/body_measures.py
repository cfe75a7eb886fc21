"""Position and velocity of single bodies at a frame's end; force and torque, means over it."""

from __future__ import annotations

import numpy as np

from flowborne.coupling.named import BodyState, Named, Report
from flowborne.kernels.arrays import Array
from flowborne.solids.model import SolidModel

UNITS = {
    "centre": "m",
    "velocity": "m/s",
    "rotation": "rad/s",
    "force": "N",
    "torque": "Nm",
    "added_mass_force": "N",
    "added_mass_torque": "Nm",
}
"""Quantity -> its unit; a torque is about the centre of mass, an added-mass one is a part of it."""


class BodyMeasures:
    """Columns of a history for the bodies that a scene names.

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

    def values(self, q: Array, report: Report | None) -> dict[str, float]:
        """column -> number, at positions q (nq,) after the frame of `report`; without a report nan
        for what needs a step."""
        named = Named(self._model, q, report)
        numbers = [x for name in self._names for x in _numbers(named.body(name))]
        return dict(zip(self.columns, numbers, strict=True))


def _numbers(body: BodyState) -> list[float]:
    """Every quantity of UNITS, in its order."""
    state = (body.centre, body.velocity, body.angular_velocity)
    parts = (*state, body.force, body.torque, body.added_mass_force, body.added_mass_torque)
    found: list[float] = np.concatenate(parts).tolist()
    return found
