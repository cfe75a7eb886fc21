"""What the sides of a domain do, and sources in it."""

from __future__ import annotations

from flowborne.fluid.boundary import (
    Boundaries,
    Boundary,
    BoundaryClosed,
    BoundaryInflow,
    BoundaryNoSlip,
    BoundaryOpen,
    BoundaryPeriodic,
    Profile,
    Source,
)

__all__ = [
    "Boundaries",
    "Boundary",
    "BoundaryClosed",
    "BoundaryInflow",
    "BoundaryNoSlip",
    "BoundaryOpen",
    "BoundaryPeriodic",
    "Profile",
    "Source",
]
