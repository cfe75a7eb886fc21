"""What happens at each side of the domain, and what enters inside it.

The six sides are named x_min, x_max, y_min, y_max, z_min, z_max. Each is one of

  closed    free slip: nothing crosses, nothing sticks
  no-slip   the wall's own velocity (a lid may slide)
  open      dynamic pressure 0 at the side; what leaves has its own velocity, what comes in the mean
            of the side
  inflow    a given velocity, in space and time
  periodic  joined to the opposite side
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from flowborne.fluid.grid import Array, Grid

SIDES = ("x_min", "x_max", "y_min", "y_max", "z_min", "z_max")

Profile = Callable[[Array, Array, Array, float], tuple[Array, Array, Array]]
"""velocity(x, y, z, time) -> (u, v, w): broadcasting arrays in m and s to m/s."""


class Boundary:
    """One side of the domain."""

    kind: str = ""


@dataclass(frozen=True)
class BoundaryClosed(Boundary):
    """Free-slip wall."""

    kind = "closed"


@dataclass(frozen=True)
class BoundaryNoSlip(Boundary):
    """Wall that the fluid sticks to; it may slide in its own plane with `velocity` (m/s)."""

    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    kind = "no-slip"


@dataclass(frozen=True)
class BoundaryOpen(Boundary):
    """Dynamic pressure is zero here; fluid leaves and enters freely."""

    kind = "open"


@dataclass(frozen=True)
class BoundaryInflow(Boundary):
    """Velocity given by `profile`; carried scalars enter with the values in `scalars`."""

    profile: Profile
    scalars: dict[str, Callable[[Array, Array, Array, float], Array]] = field(default_factory=dict)
    kind = "inflow"


@dataclass(frozen=True)
class BoundaryPeriodic(Boundary):
    """Joined to the opposite side."""

    kind = "periodic"


@dataclass(frozen=True)
class Source:
    """A box inside the domain through which fluid enters or is driven.

    lower, upper  corners of the box in m
    volume_rate   m^3/s (m^2/s per unit depth in a slab) of fluid that appears, or None
    velocity      m/s imposed on the faces inside the box after advection, or None
    scalars       values that carried scalars have inside the box
    times         (start, stop) in s
    """

    lower: tuple[float, float, float]
    upper: tuple[float, float, float]
    volume_rate: float | None = None
    velocity: tuple[float, float, float] | None = None
    scalars: dict[str, float] = field(default_factory=dict)
    times: tuple[float, float] = (0.0, np.inf)

    def active(self, time: float) -> bool:
        return self.times[0] <= time < self.times[1]


@dataclass(frozen=True)
class Boundaries:
    """The six sides of a domain.

    raises  ValueError when one of two opposite sides is periodic and the other is not, or when a
            side that is not closed or periodic is given in z of a slab
    """

    x_min: Boundary = BoundaryClosed()
    x_max: Boundary = BoundaryClosed()
    y_min: Boundary = BoundaryClosed()
    y_max: Boundary = BoundaryClosed()
    z_min: Boundary = BoundaryClosed()
    z_max: Boundary = BoundaryClosed()

    def __post_init__(self) -> None:
        for axis, name in enumerate("xyz"):
            low, high = self.pair(axis)
            if (low.kind == "periodic") != (high.kind == "periodic"):
                raise ValueError(
                    f"boundaries {name}_min is {low.kind} and {name}_max is {high.kind}: "
                    "make both of them periodic or neither"
                )

    def pair(self, axis: int) -> tuple[Boundary, Boundary]:
        """Lower and upper side across `axis`."""
        return self._pairs[axis]

    def periodic(self) -> tuple[bool, bool, bool]:
        return self._periodic

    @cached_property
    def _pairs(self) -> tuple[tuple[Boundary, Boundary], ...]:
        sides = [getattr(self, name) for name in SIDES]
        return tuple(zip(sides[::2], sides[1::2], strict=True))

    @cached_property
    def _periodic(self) -> tuple[bool, bool, bool]:
        x, y, z = (low.kind == "periodic" for low, _ in self._pairs)
        return x, y, z

    def has_open_side(self, grid: Grid) -> bool:
        return any(side.kind == "open" for axis in grid.axes for side in self.pair(axis))

    def check(self, grid: Grid) -> None:
        """Raise ValueError when a slab's z sides are not closed."""
        if grid.is_slab and any(side.kind != "closed" for side in self.pair(2)):
            raise ValueError(
                "a two-dimensional domain has no sides in z: leave z_min and z_max closed"
            )


def cells_in(source: Source, grid: Grid) -> tuple[slice, slice, slice]:
    """Cells whose centres lie inside a source's box; all layers of a slab."""
    ranges = []
    for axis, centres in enumerate(grid.cell_coordinates()):
        if axis not in grid.axes:
            ranges.append(slice(None))
            continue
        low = int(np.searchsorted(centres, source.lower[axis], side="left"))
        high = int(np.searchsorted(centres, source.upper[axis], side="right"))
        ranges.append(slice(low, high))
    return ranges[0], ranges[1], ranges[2]
