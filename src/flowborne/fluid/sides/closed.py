"""A wall that nothing crosses and nothing sticks to."""

from __future__ import annotations

from dataclasses import dataclass

from flowborne.fluid.sides.side import Boundary


@dataclass(frozen=True)
class BoundaryClosed(Boundary):
    """Free-slip wall: beyond it the field is mirrored."""

    kind = "closed"
    mirrors = True
