"""A side that the fluid crosses freely.

What leaves has its own velocity; what comes in has the mean velocity of the fluid along the whole
side, so that a uniform flow stays as it is and, seen from a frame that moves with the mean, no
energy comes in. With its own velocity, a jet that once comes in would go on for ever, and low
pressure behind the side would draw it in ever faster (Bruneau and Fabrie 1994).
"""

from __future__ import annotations

from dataclasses import dataclass

from flowborne.fluid.sides.side import Boundary, Place


@dataclass(frozen=True)
class BoundaryOpen(Boundary):
    """Dynamic pressure is zero here; fluid leaves and enters freely."""

    kind = "open"
    free = True

    def prescribed_velocity(self, place: Place, component: int, time: float) -> None:
        return None
