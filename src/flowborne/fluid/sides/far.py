"""A side beyond which the fluid goes on as if for ever.

What bodies in endless fluid do at once is the pressure of a dipole, p = d.r / r^D in D dimensions.
Of all multiples of p, dp/dn = -(D - 1) (n.r) / r^2 p fits it best over all directions d, which is a
column of fluid of the length r^2 / ((D - 1) n.r) behind each face with p = 0 at its end. r is
measured from the middle of the domain, so that the matrix stays the same while bodies move; where
one end of an axis is a mirror, that is at the mirror.

For dipoles along the axes `fluid.dipoles` makes it exact. What the vorticity inside does is in
`coupling.far_field`. The sea may flow: the side through which its stream leaves is open.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from flowborne.fluid.grid import Array, Grid
from flowborne.fluid.sides.kinds import BoundaryOpen
from flowborne.fluid.sides.side import Boundary, Pair, Place
from flowborne.kernels.arrays import FREE

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

    def among(self, pairs: Sequence[Pair]) -> BoundaryFar:
        """Raises ValueError when nothing is open or far across other axes, or another far side has
        another velocity."""
        for side in (side for pair in pairs for side in pair):
            if isinstance(side, BoundaryFar) and side.stream != self.stream:
                raise ValueError(
                    f"boundaries: far sides have the velocities {list(self.velocity)} and "
                    f"{list(side.velocity)}, or other strengths. {ONE_SEA}"
                )
        centre = centre_among(pairs)
        if in_channel(centre):
            raise ValueError(f"boundaries: {CHANNEL}")
        return replace(self, centre=centre)

    @property
    def stream(self) -> tuple[Velocity, Strength]:
        return self.velocity, self.strength

    def is_exit(self, place: Place) -> bool:
        """Whether the stream leaves through the side at a place."""
        return exit_of(self.velocity) == (place.axis, place.upper)

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


def exit_of(velocity: Velocity) -> tuple[int, bool] | None:
    """Axis, and whether the upper side across it, through which a stream leaves: that which most of
    it crosses; None without a stream."""
    axis = max(range(3), key=lambda axis: abs(velocity[axis]))
    return (axis, velocity[axis] > 0.0) if velocity[axis] else None


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
