"""A side beyond which the fluid goes on as if for ever, and the sea that is there.

What bodies in endless fluid do at once is the pressure of a dipole, p = d.r / r^D in D dimensions.
Of all multiples of p, dp/dn = -(D - 1) (n.r) / r^2 p fits it best over all directions d, which is a
column of fluid of the length r^2 / ((D - 1) n.r) behind each face with p = 0 at its end. r is
measured from the middle of the domain, so that the matrix stays the same while bodies move; where
one end of an axis is a mirror, that is at the mirror.

For dipoles along the axes `fluid.dipoles` makes it exact. What the vorticity inside does is in
`fluid.wake`.

A domain lies in a sea where all its sides are far, or closed opposite a far one: such a side is a
mirror. The sea may flow, with the velocity of its far sides: the side through which its stream
leaves is open.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from flowborne.fluid.grid import Grid
from flowborne.fluid.sides.kinds import BoundaryOpen
from flowborne.fluid.sides.side import Boundary, Pair, Place
from flowborne.kernels.arrays import FREE, PRESCRIBED, Array

Centre = tuple[float | None, float | None, float | None]
"""Along each axis the part of the way from the lower to the upper side; None along one on which the
pressure outside does not depend."""

CHANNEL = (
    "only the sides across one axis are far or open, and an endless channel of fluid cannot be set "
    "in motion. Make a side across another axis far, or these open"
)
"""What is wrong with far sides `in_channel`, and the remedy."""

ONE_SEA = "Give all of them the same: there is one sea"
"""The remedy where far sides differ."""


Velocity = tuple[float, float, float]


class Strength(Protocol):
    """How strong a stream or a mouth is over time."""

    def at(self, time: float) -> float:
        """Part of the full velocity or rate at `time` (s); of a stream's at least 0."""
        ...


@dataclass(frozen=True)
class Steady:
    """Always the full velocity."""

    def at(self, time: float) -> float:
        """1."""
        return 1.0


@dataclass(frozen=True)
class BoundaryFar(BoundaryOpen):
    """An open side with a column of fluid behind each of its faces.

    velocity  of the sea, m/s; all far sides of a domain have the same
    strength  of it, over time
    centre    from which r is measured; `Boundaries` sets it to that of `centre_among` its sides
    """

    velocity: Velocity = (0.0, 0.0, 0.0)
    strength: Strength = Steady()
    centre: Centre = (0.5, 0.5, 0.5)
    kind = "far"
    endless = True
    steady = False  # what comes in is as the flow inside has it

    def among(self, pairs: Sequence[Pair]) -> BoundaryFar:
        """Raises ValueError when nothing is open or far across other axes, or another far side has
        another velocity."""
        for side in (side for pair in pairs for side in pair):
            if not isinstance(side, BoundaryFar):
                continue
            if (side.velocity, side.strength) != (self.velocity, self.strength):
                raise ValueError(
                    f"boundaries: far sides have the velocities {list(self.velocity)} and "
                    f"{list(side.velocity)}, or other strengths. {ONE_SEA}"
                )
        centre = centre_among(pairs)
        if in_channel(centre):
            raise ValueError(f"boundaries: {CHANNEL}")
        return replace(self, centre=centre)

    def is_exit(self, place: Place) -> bool:
        """Whether the stream leaves through the side at a place: that which most of it crosses."""
        axis = max(range(3), key=lambda axis: abs(self.velocity[axis]))
        most = self.velocity[axis]
        return most != 0.0 and (place.axis, place.upper) == (axis, most > 0.0)

    def irrotational_inflow(self, place: Place) -> bool:
        return not self.is_exit(place)

    def pressure_weight(self, place: Place) -> Array | float:
        if self.is_exit(place):
            return 1.0
        lengths = self.lengths(place.grid, place.cell_coordinates())
        distance2 = sum(length**2 for length in lengths.values())
        column = distance2 / ((len(lengths) - 1) * abs(lengths[place.axis]))
        half = 0.5 * place.grid.spacing
        return half / (half + column)

    def velocity_beyond(self, velocity: Array, place: Place, component: int, time: float) -> Array:
        """That of the sea, and what differs from it falls as the velocity of a dipole, r^-D."""
        lengths = self.lengths(place.grid, place.face_coordinates(component))
        h = place.grid.spacing
        distance2 = sum(length**2 for length in lengths.values())
        farther2 = distance2 + h * (2.0 * abs(lengths[place.axis]) + h)
        sea = self.strength.at(time) * self.velocity[component]
        return sea + (velocity - sea) * (distance2 / farther2) ** (0.5 * len(lengths))

    def lengths(self, grid: Grid, at: tuple[Array, Array, Array]) -> dict[int, Array]:
        """Components of r at places, by axis, m."""
        return {
            axis: at[axis] - (1.0 - part) * grid.origin[axis] - part * grid.upper[axis]
            for axis in grid.axes
            if (part := self.centre[axis]) is not None
        }


def centre_among(pairs: Sequence[Pair]) -> Centre:
    """Where the middle of bodies and their mirror images is.

    A side that lets nothing through mirrors what is in front of it, and an open one does so with
    the sign changed. Between two sides that let nothing through, or two periodic ones, the pressure
    outside does not depend on the place along their axis.
    """
    x, y, z = (_between(low, high) for low, high in pairs)
    return x, y, z


def in_channel(centre: Centre) -> bool:
    """Whether the pressure outside depends on the place along one axis only."""
    return centre.count(None) > 1


def _between(low: type[Boundary] | Boundary, high: type[Boundary] | Boundary) -> float | None:
    ends = (low.normal == FREE) + low.endless, (high.normal == FREE) + high.endless
    if ends == (0, 0):
        return None
    return 0.5 if ends[0] == ends[1] else float(ends[0] > ends[1])


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
