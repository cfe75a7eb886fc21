"""The sea around a domain with far sides: its velocity, where its stream leaves, and mirrors.

A domain lies in a sea where all its sides are far, or closed opposite a far one: such a side is a
mirror. The sea's uniform velocity is that of its far sides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flowborne.fluid.grid import Array
from flowborne.fluid.sides.far import BoundaryFar, Velocity
from flowborne.fluid.sides.side import Boundary, Place
from flowborne.kernels.arrays import FREE, PRESCRIBED

PARTLY = (
    "far sides have a velocity, and other sides take part in the flow. Make every side far, or "
    "closed opposite a far one"
)
"""What is wrong with a stream in a domain that lies in no sea, and the remedy."""

ACROSS = (
    "the sea's velocity crosses a closed side. Make its component across that side 0, or the side "
    "far"
)
"""What is wrong with a stream against a mirror, and the remedy."""


@dataclass(frozen=True)
class Sea:
    """What is around a domain.

    side     one of its far sides: all have the sea's velocity
    far      their places
    mirrors  places of the closed sides
    exit     place of the far side through which the stream leaves; None in still water
    """

    side: BoundaryFar
    far: tuple[Place, ...]
    mirrors: tuple[Place, ...]
    exit: Place | None

    def velocity(self, time: float) -> Array:
        """(3,) m/s at `time` (s)."""
        return self.side.strength.at(time) * np.array(self.side.velocity)

    @property
    def driven(self) -> tuple[Place, ...]:
        """The far sides but the exit."""
        return tuple(place for place in self.far if place != self.exit)


def sea_of(sides: Sequence[tuple[Place, Boundary]]) -> Sea | None:
    """The sea around a domain with these sides; None where no side is far, or others take part.

    raises  ValueError when the sea has a velocity, and other sides take part or it crosses a mirror
    """
    far = [(place, side) for place, side in sides if isinstance(side, BoundaryFar)]
    if not far:
        return None
    first, kinds = far[0][1], [(place.axis, side) for place, side in sides]
    if problem := stream_problem(first.velocity, kinds):
        raise ValueError(f"boundaries: {problem}")
    if not in_sea(kinds):
        return None
    leaves = [place for place, side in far if side.is_exit(place)]
    mirrors = tuple(place for place, side in sides if is_mirror(side))
    return Sea(first, tuple(p for p, _ in far), mirrors, leaves[0] if leaves else None)


Kinds = Sequence[tuple[int, Boundary | type[Boundary]]]
"""The sides of a domain, or their kinds, each with the axis that it is across."""


def is_mirror(side: Boundary | type[Boundary]) -> bool:
    """Whether the flow beyond a side would be the mirror image of that inside."""
    return side.normal == PRESCRIBED and side.tangential == FREE


def in_sea(sides: Kinds) -> bool:
    """Whether all sides are far, or mirrors opposite far ones."""
    far = {axis for axis, side in sides if side.endless}
    return all(side.endless or (is_mirror(side) and axis in far) for axis, side in sides)


def stream_problem(velocity: Velocity, sides: Kinds) -> str | None:
    """What is wrong with the velocity of far sides, and the remedy; None if nothing is."""
    if not any(velocity):
        return None
    if not in_sea(sides):
        return PARTLY
    return ACROSS if any(velocity[axis] for axis, side in sides if is_mirror(side)) else None


def number_of(place: Place) -> int:
    """Index of a place among the sides of a domain."""
    return 2 * place.axis + place.upper
