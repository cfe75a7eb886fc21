"""A side beyond which the fluid goes on at the opposite one."""

from __future__ import annotations

from dataclasses import dataclass

from flowborne.fluid.grid import Array
from flowborne.fluid.sides.side import Boundary, Place


@dataclass(frozen=True)
class BoundaryPeriodic(Boundary):
    """Joined to the opposite side: the last faces are the first ones."""

    kind = "periodic"
    joined = True

    def prescribed_velocity(self, place: Place, component: int, time: float) -> None:
        return None

    def impose(self, field: Array, place: Place, time: float) -> None:
        if place.upper:
            field[place.layer] = field[Place(place.grid, place.axis, upper=False).layer]
