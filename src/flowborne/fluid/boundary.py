"""The six sides of a domain, and what enters inside it.

The sides are named x_min, x_max, y_min, y_max, z_min, z_max; `sides` has what each may be.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from flowborne.fluid.dipoles import Dipoles, dipoles_of
from flowborne.fluid.grid import Grid
from flowborne.fluid.sides.far import Sea, sea_of
from flowborne.fluid.sides.kinds import BoundaryClosed
from flowborne.fluid.sides.side import Boundary, Place
from flowborne.kernels.arrays import FREE, PERIODIC, PRESCRIBED, Array, FaceGrid, Integers

if TYPE_CHECKING:
    from flowborne.kernels.carry import Sides

WALL = BoundaryClosed()

KEPT = 16
"""Grids for which what is around is kept, at most: one that moves has another origin each time."""

SIDES = ("x_min", "x_max", "y_min", "y_max", "z_min", "z_max")


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
class Around:
    """The sides of one grid with their places, and what follows from them: see `Boundaries`."""

    grid: Grid
    sides: list[tuple[Place, Boundary]]

    @cached_property
    def faces(self) -> list[FaceGrid]:
        rings = {place.axis for place, side in self.sides if side.normal == PERIODIC}
        x, y, z = (n * (axis in rings) for axis, n in enumerate(self.grid.shape))
        shapes = [self.grid.face_shape(axis) for axis in range(3)]
        if not self.grid.is_slab:
            return [FaceGrid(axis, shape, (x, y, z)) for axis, shape in enumerate(shapes)]
        # one layer thick along the first of the kernels' axes
        return [FaceGrid(n + 1, (1, *shape[:2]), (0, x, y)) for n, shape in enumerate(shapes)]

    @cached_property
    def layers(self) -> dict[tuple[int, int], Sides] | None:
        return {} if all(side.steady for _, side in self.sides) else None

    @cached_property
    def steady_across(self) -> list[tuple[Place, Array | float]] | None:
        return None if self.layers is None else self.across(0.0)

    def across(self, time: float) -> list[tuple[Place, Array | float]]:
        return [
            (place, side.prescribed_velocity(place, place.axis, time))
            for place, side in self.sides
            if side.normal == PRESCRIBED
        ]

    @cached_property
    def weights(self) -> list[tuple[Place, Array | float]]:
        return [
            (place, side.pressure_weight(place))
            for place, side in self.sides
            if side.normal != PERIODIC
        ]

    @cached_property
    def sea(self) -> Sea | None:
        return sea_of(self.sides)

    @cached_property
    def dipoles(self) -> Dipoles | None:
        return dipoles_of(self.sides)


@dataclass(frozen=True)
class Boundaries:
    """The six sides of a domain.

    raises  ValueError when one of two opposite sides is periodic and the other is not, or when far
            sides have nothing open or far across another axis, or different velocities
    """

    x_min: Boundary = WALL
    x_max: Boundary = WALL
    y_min: Boundary = WALL
    y_max: Boundary = WALL
    z_min: Boundary = WALL
    z_max: Boundary = WALL

    def __post_init__(self) -> None:
        for axis, name in enumerate("xyz"):
            low, high = self.pair(axis)
            if (low.normal == PERIODIC) != (high.normal == PERIODIC):
                raise ValueError(
                    f"boundaries {name}_min is {low.kind} and {name}_max is {high.kind}: "
                    "make both of them periodic or neither"
                )

    def pair(self, axis: int) -> tuple[Boundary, Boundary]:
        """Lower and upper side across `axis`."""
        return self._pairs[axis]

    def periodic(self) -> tuple[bool, bool, bool]:
        """Of each axis."""
        return self._periodic

    @cached_property
    def _periodic(self) -> tuple[bool, bool, bool]:
        x, y, z = (low.normal == PERIODIC for low, _ in self._pairs)
        return x, y, z

    @cached_property
    def _pairs(self) -> tuple[tuple[Boundary, Boundary], ...]:
        sides = [getattr(self, name) for name in SIDES]
        pairs = list(zip(sides[::2], sides[1::2], strict=True))
        return tuple((low.among(pairs), high.among(pairs)) for low, high in pairs)

    def around(self, grid: Grid) -> list[tuple[Place, Boundary]]:
        """Every side of a grid, with its place: along each axis the lower and then the upper."""
        return self._on(grid).sides

    def faces(self, axis: int, grid: Grid) -> FaceGrid:
        """The faces of a grid across an axis, as kernels take them."""
        return self._on(grid).faces[axis]

    def steady_layers(self, grid: Grid) -> dict[tuple[int, int], Sides] | None:
        """What steady sides prescribe to the velocity, to be filled by `ghosts.packed_sides`; None
        where one of a grid is not steady."""
        return self._on(grid).layers

    def across(self, grid: Grid, time: float) -> list[tuple[Place, Array | float]]:
        """Places of the sides that prescribe the velocity across them, and that at `time` (s), m/s;
        of steady sides kept."""
        around = self._on(grid)
        return around.steady_across or around.across(time)

    def pressure_weights(self, grid: Grid) -> list[tuple[Place, Array | float]]:
        """Places of the sides that are not periodic, and their `pressure_weight`."""
        return self._on(grid).weights

    def normal(self) -> Integers:
        """(3, 2) a of the velocity across the lower and upper side of each axis: PRESCRIBED, FREE
        or PERIODIC."""
        return self._normal

    @cached_property
    def _normal(self) -> Integers:
        return np.array([[side.normal for side in pair] for pair in self._pairs], np.int64)

    def sea(self, grid: Grid) -> Sea | None:
        """The sea around a grid; raises ValueError as `sea_of` does."""
        return self._on(grid).sea

    def dipoles(self, grid: Grid) -> Dipoles | None:
        """What far sides of a grid answer to dipoles besides their columns; see `dipoles_of`."""
        return self._on(grid).dipoles

    def _on(self, grid: Grid) -> Around:
        found = self._known.get(grid)
        if found is None:
            sides = [(place, self._pairs[place.axis][place.upper]) for place in places(grid)]
            found = Around(grid, sides)
            if len(self._known) >= KEPT:
                self._known.clear()
            self._known[grid] = found
        return found

    @cached_property
    def _known(self) -> dict[Grid, Around]:
        return {}

    def has_free_side(self, grid: Grid) -> bool:
        """Whether the pressure decides what crosses one of the sides."""
        return any(side.normal == FREE for _, side in self.around(grid))

    def gain_energy(self, grid: Grid) -> bool:
        """Whether fluid that comes in through one of the sides may bring energy."""
        return any(side.normal == FREE and not side.endless for _, side in self.around(grid))

    def check(self, grid: Grid) -> None:
        """Raise ValueError when a slab's z sides are not closed."""
        if grid.is_slab and self.pair(2) != (WALL, WALL):
            raise ValueError(
                "a two-dimensional domain has no sides in z: leave z_min and z_max closed"
            )


@lru_cache(maxsize=64)
def places(grid: Grid) -> tuple[Place, ...]:
    """Where the sides of a grid lie: along each axis the lower and then the upper."""
    return tuple(Place(grid, axis, upper) for axis in grid.axes for upper in (False, True))


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
