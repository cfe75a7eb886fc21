"""The sides of a scene's domain: their tables, checks and boundaries."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from typing import Annotated, ClassVar, Literal

from flowborne.base.tables import ByKind, Places, Table, Vector, triple
from flowborne.fluid.grid import Grid
from flowborne.fluid.sides.far import (
    CHANNEL,
    ONE_SEA,
    BoundaryFar,
    centre_among,
    in_channel,
    stream_problem,
)
from flowborne.fluid.sides.kinds import (
    BoundaryClosed,
    BoundaryInflow,
    BoundaryNoSlip,
    BoundaryOpen,
    BoundaryPeriodic,
)
from flowborne.fluid.sides.side import Boundary
from flowborne.kernels.arrays import FREE, PERIODIC, Array
from flowborne.motion.inflow import InflowProfile
from flowborne.scenes.domain import Domain
from flowborne.scenes.factors import RampTable

DyeValue = Callable[[Array, Array, Array, float], Array]
Side = Literal["x_min", "x_max", "y_min", "y_max", "z_min", "z_max"]


class AnySideTable(Table):
    """What every side has."""

    boundary: ClassVar[type[Boundary]]

    def build(self, grid: Grid, normal: int, dyes: dict[str, DyeValue]) -> Boundary:
        """The boundary across the axis `normal` of a grid, with the dyes that enter there."""
        return self.boundary()

    def check(self, normal: int) -> Iterator[str]:
        """What is wrong with it across the axis `normal`."""
        return iter(())

    def stream(self) -> Vector | None:
        """Mean velocity with which fluid comes in, m/s; None where the side gives it none."""
        return None

    def fastest(self, dimensions: int) -> float:
        """Largest speed of that at any time, the axes added up, m/s."""
        return 0.0


class ClosedSide(AnySideTable):
    """Free-slip wall."""

    boundary = BoundaryClosed
    kind: Literal["closed"]


class NoSlipSide(AnySideTable):
    """Wall that the fluid sticks to.

    velocity  m/s with which it slides in its own plane
    """

    boundary = BoundaryNoSlip
    kind: Literal["no-slip"]
    velocity: Vector = (0.0, 0.0, 0.0)

    def build(self, grid: Grid, normal: int, dyes: dict[str, DyeValue]) -> BoundaryNoSlip:
        return BoundaryNoSlip(triple(self.velocity))

    def check(self, normal: int) -> Iterator[str]:
        if self.velocity[normal] != 0.0:
            yield (
                f"velocity {list(self.velocity)} moves the wall out of its place. "
                f"Make its {'xyz'[normal]} component 0."
            )


class OpenSide(AnySideTable):
    """Fluid leaves and enters freely."""

    boundary = BoundaryOpen
    kind: Literal["open"]


class FarSide(AnySideTable, RampTable):
    """Open to a sea, in which bodies move as if the fluid went on for ever.

    velocity  of the sea, m/s; all far sides have the same
    ramp      s over which it rises smoothly from rest
    times     s, instead of ramp: keyframes between which `factors` of the velocity change smoothly
    """

    boundary = BoundaryFar
    kind: Literal["far"]
    velocity: Vector = (0.0, 0.0, 0.0)

    def build(self, grid: Grid, normal: int, dyes: dict[str, DyeValue]) -> BoundaryFar:
        return BoundaryFar(triple(self.velocity), self.factor())

    def stream(self) -> Vector | None:
        return self.velocity if any(self.velocity) else None

    def fastest(self, dimensions: int) -> float:
        return self.strongest() * sum(map(abs, self.velocity))


class PeriodicSide(AnySideTable):
    """Joined to the opposite side."""

    boundary = BoundaryPeriodic
    kind: Literal["periodic"]


class InflowSide(AnySideTable, RampTable):
    """Fluid enters with a given velocity.

    velocity  m/s; with profile "parabolic" its mean over the side
    profile   "uniform", or "parabolic" (0 at the edges of the side)
    ramp      s over which it rises smoothly from rest
    times     s, instead of ramp: keyframes between which `factors` of the velocity change smoothly
    """

    boundary = BoundaryInflow
    kind: Literal["inflow"]
    velocity: Vector
    profile: Literal["uniform", "parabolic"] = "uniform"

    def build(self, grid: Grid, normal: int, dyes: dict[str, DyeValue]) -> BoundaryInflow:
        factor = self.factor()
        if self.profile == "uniform":
            return BoundaryInflow(InflowProfile(triple(self.velocity), factor), dyes)
        spans = tuple(
            (axis, grid.origin[axis], grid.upper[axis]) for axis in grid.axes if axis != normal
        )
        return BoundaryInflow(InflowProfile(triple(self.velocity), factor, spans), dyes)

    def stream(self) -> Vector:
        return self.velocity

    def fastest(self, dimensions: int) -> float:
        peak = 1.5 ** (dimensions - 1) if self.profile == "parabolic" else 1.0
        return peak * self.strongest() * sum(map(abs, self.velocity))


BoundarySide = Annotated[
    ClosedSide | NoSlipSide | OpenSide | FarSide | InflowSide | PeriodicSide, *ByKind
]

_CLOSED = ClosedSide(kind="closed")


class BoundariesTable(Table):
    """[boundaries]: what happens at each side; "open" stands for {kind = "open"}.

    x_min, x_max  the sides across x, with the smallest and the largest x
    y_min, y_max  across y
    z_min, z_max  across z; not in two dimensions
    """

    x_min: BoundarySide = _CLOSED
    x_max: BoundarySide = _CLOSED
    y_min: BoundarySide = _CLOSED
    y_max: BoundarySide = _CLOSED
    z_min: BoundarySide = _CLOSED
    z_max: BoundarySide = _CLOSED

    def periodic(self, axis: int) -> bool:
        """Whether bodies may cross the sides across an axis."""
        return bool(getattr(self, f"{'xyz'[axis]}_min").boundary.normal == PERIODIC)


def check_sides(places: Places, boundaries: BoundariesTable, *, slab: bool) -> Iterator[str]:
    sides = dict(boundaries)
    for axis, name in enumerate("xyz"):
        low, high = sides[f"{name}_min"], sides[f"{name}_max"]
        if (low.boundary.normal == PERIODIC) != (high.boundary.normal == PERIODIC):
            yield (
                f"{places.at('boundaries')}: {name}_min is {low.kind} and {name}_max is "
                f"{high.kind}. Make both of them periodic or neither."
            )
        for side, table in ((f"{name}_min", low), (f"{name}_max", high)):
            if axis == 2 and slab and table != _CLOSED:
                yield (
                    f"{places.at('boundaries', side)} is {table.kind}, but a scene of 2 dimensions "
                    "has no sides in z. Drop it."
                )
            for problem in table.check(axis):
                yield f"{places.at('boundaries', side)}: {problem}"
    kinds = [side.boundary for side in sides.values()]
    centre = centre_among(list(zip(kinds[::2], kinds[1::2], strict=True)))
    if any(kind.endless for kind in kinds) and in_channel(centre):
        yield f"{places.at('boundaries')}: {CHANNEL}."
    yield from _check_sea(places, sides, 2 if slab else 3)


def _check_sea(places: Places, sides: dict[str, BoundarySide], dimensions: int) -> Iterator[str]:
    """All far sides have one velocity, and a stream needs a sea all around."""
    far = {name: side for name, side in sides.items() if isinstance(side, FarSide)}
    if not far:
        return
    (name, first), *others = far.items()
    for other, side in others:
        if side != first:
            yield (
                f"{places.at('boundaries', other)} has another velocity or another change in time "
                f"than {name}. {ONE_SEA}."
            )
            return
    if first.factors and min(first.factors) < 0.0:
        yield (
            f"{places.at('boundaries', name)}: factors {list(first.factors)} turn the sea's stream "
            "around, and it leaves through one side only. Keep them at 0 or above."
        )
        return
    there = [
        ("xyz".index(name[0]), side.boundary)
        for name, side in sides.items()
        if name[0] in "xyz"[:dimensions]
    ]
    problem = stream_problem(triple(first.velocity), there)
    if problem:
        yield f"{places.at('boundaries')}: {problem}."


def check_outlet(
    places: Places, boundaries: BoundariesTable, domain: Domain, rates: Iterable[float]
) -> Iterator[str]:
    """Fluid that comes in must be able to leave.

    rates  volume rates of the sources, m^3/s
    """
    kinds = {name: side.boundary for name, side in boundaries}
    ends = [(kinds[f"{a}_min"].normal, kinds[f"{a}_max"].normal) for a in "xyz"]
    unclear = any((low == PERIODIC) != (high == PERIODIC) for low, high in ends)
    if unclear or any(FREE in pair for pair in ends):
        return
    total, largest = 0.0, 0.0
    for name, side in boundaries:
        stream = side.stream()
        if stream is not None:
            axis = "xyz".index(name[0])
            others = [e for i, e in enumerate(domain.extent()) if i != axis]
            inward = 1.0 if name.endswith("min") else -1.0
            flux = inward * stream[axis] * math.prod(others)
            total, largest = total + flux, max(largest, abs(flux))
    for rate in rates:
        total, largest = total + rate, max(largest, abs(rate))
    if abs(total) > 1e-9 * largest:
        yield (
            f"{places.at('boundaries')}: {total:+g} m^{len(domain.lower)}/s enters through inflow "
            "sides and sources, and no side is open for as much to leave. Make a side open."
        )
