"""A side beyond which the fluid goes on as if for ever.

What bodies in endless fluid do at once is the pressure of a dipole, p = d.r / r^D in D dimensions.
Of all multiples of p, dp/dn = -(D - 1) (n.r) / r^2 p fits it best over all directions d, which is a
column of fluid of the length r^2 / ((D - 1) n.r) behind each face with p = 0 at its end. r is
measured from the middle of the domain, so that the matrix stays the same while bodies move; where
one end of an axis is a mirror, that is at the mirror.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from flowborne.fluid.grid import Array
from flowborne.fluid.sides.open import BoundaryOpen
from flowborne.fluid.sides.side import Boundary, Pair, Place

Centre = tuple[float | None, float | None, float | None]
"""Along each axis the part of the way from the lower to the upper side; None along one on which the
pressure outside does not depend."""

CHANNEL = (
    "only the sides across one axis are far or open, and an endless channel of fluid cannot be set "
    "in motion. Make a side across another axis far, or these open"
)
"""What is wrong with far sides `in_channel`, and the remedy."""


@dataclass(frozen=True)
class BoundaryFar(BoundaryOpen):
    """An open side with a column of fluid behind each of its faces.

    centre  from which r is measured; `Boundaries` sets it to that of `centre_among` its sides
    """

    centre: Centre = (0.5, 0.5, 0.5)
    kind = "far"
    endless = True

    def among(self, pairs: Sequence[Pair]) -> BoundaryFar:
        """Raises ValueError when nothing is open or far across other axes."""
        centre = centre_among(pairs)
        if in_channel(centre):
            raise ValueError(f"boundaries: {CHANNEL}")
        return replace(self, centre=centre)

    def irrotational_inflow(self, place: Place) -> bool:
        return True

    def pressure_weight(self, place: Place) -> Array:
        grid, at = place.grid, place.cell_coordinates()
        lengths = {
            axis: at[axis] - (1.0 - part) * grid.origin[axis] - part * grid.upper[axis]
            for axis in grid.axes
            if (part := self.centre[axis]) is not None
        }
        distance2 = sum(length**2 for length in lengths.values())
        column = distance2 / ((len(lengths) - 1) * abs(lengths[place.axis]))
        half = 0.5 * grid.spacing
        return half / (half + column)


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
    ends = low.free + low.endless, high.free + high.endless
    if ends == (0, 0):
        return None
    return 0.5 if ends[0] == ends[1] else float(ends[0] > ends[1])
