"""A wall that the fluid sticks to."""

from __future__ import annotations

from dataclasses import dataclass

from flowborne.fluid.sides.side import Boundary, Place


@dataclass(frozen=True)
class BoundaryNoSlip(Boundary):
    """Wall that the fluid sticks to; it may slide in its own plane with `velocity` (m/s)."""

    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    kind = "no-slip"

    def prescribed_velocity(self, place: Place, component: int, time: float) -> float:
        return self.velocity[component] if component != place.axis else 0.0
