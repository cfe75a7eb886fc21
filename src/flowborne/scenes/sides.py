"""The sides of a scene's domain: their tables, checks and boundaries."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from typing import Annotated, Literal, Self

from pydantic import model_validator

from flowborne.fluid.boundary import (
    Boundary,
    BoundaryClosed,
    BoundaryInflow,
    BoundaryNoSlip,
    BoundaryOpen,
    BoundaryPeriodic,
)
from flowborne.fluid.grid import Array, Grid
from flowborne.motion.inflow import FactorRamp, FactorSteady, InflowProfile
from flowborne.scenes.domain import Domain
from flowborne.scenes.factors import FactorsTable
from flowborne.tables import ByKind, NotNegative, Places, Table, Vector, triple

DyeValue = Callable[[Array, Array, Array, float], Array]
Side = Literal["x_min", "x_max", "y_min", "y_max", "z_min", "z_max"]


class AnySideTable(Table):
    """What every side has."""

    def build(self, grid: Grid, normal: int, dyes: dict[str, DyeValue]) -> Boundary:
        """The boundary across the axis `normal` of a grid, with the dyes that enter there."""
        raise NotImplementedError


class ClosedSide(AnySideTable):
    """Free-slip wall."""

    kind: Literal["closed"]

    def build(self, grid: Grid, normal: int, dyes: dict[str, DyeValue]) -> BoundaryClosed:
        return BoundaryClosed()


class NoSlipSide(AnySideTable):
    """Wall that the fluid sticks to.

    velocity  m/s with which it slides in its own plane
    """

    kind: Literal["no-slip"]
    velocity: Vector = (0.0, 0.0, 0.0)

    def build(self, grid: Grid, normal: int, dyes: dict[str, DyeValue]) -> BoundaryNoSlip:
        return BoundaryNoSlip(triple(self.velocity))


class OpenSide(AnySideTable):
    """Fluid leaves and enters freely."""

    kind: Literal["open"]

    def build(self, grid: Grid, normal: int, dyes: dict[str, DyeValue]) -> BoundaryOpen:
        return BoundaryOpen()


class PeriodicSide(AnySideTable):
    """Joined to the opposite side."""

    kind: Literal["periodic"]

    def build(self, grid: Grid, normal: int, dyes: dict[str, DyeValue]) -> BoundaryPeriodic:
        return BoundaryPeriodic()


class InflowSide(AnySideTable, FactorsTable):
    """Fluid enters with a given velocity.

    velocity  m/s; with profile "parabolic" its mean over the side
    profile   "uniform", or "parabolic" (0 at the edges of the side)
    ramp      s over which it rises smoothly from rest
    times     s, instead of ramp: keyframes between which `factors` of the velocity change smoothly
    """

    kind: Literal["inflow"]
    velocity: Vector
    profile: Literal["uniform", "parabolic"] = "uniform"
    ramp: NotNegative = 0.0

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.ramp > 0.0 and self.times is not None:
            raise ValueError("has both a ramp and keyframes. Keep one of them")
        return self

    def build(self, grid: Grid, normal: int, dyes: dict[str, DyeValue]) -> BoundaryInflow:
        factor = self.keyframes() or (FactorRamp(self.ramp) if self.ramp > 0.0 else FactorSteady())
        if self.profile == "uniform":
            return BoundaryInflow(InflowProfile(triple(self.velocity), factor), dyes)
        spans = tuple(
            (axis, grid.origin[axis], grid.upper[axis]) for axis in grid.axes if axis != normal
        )
        return BoundaryInflow(InflowProfile(triple(self.velocity), factor, spans), dyes)


BoundarySide = Annotated[ClosedSide | NoSlipSide | OpenSide | InflowSide | PeriodicSide, *ByKind]

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
        return getattr(self, f"{'xyz'[axis]}_min").kind == "periodic"


def _half_periodic(low: str, high: str) -> bool:
    """Whether just one of two opposite kinds of sides is periodic."""
    return (low == "periodic") != (high == "periodic")


def check_sides(places: Places, boundaries: BoundariesTable, *, slab: bool) -> Iterator[str]:
    sides = dict(boundaries)
    for axis, name in enumerate("xyz"):
        low, high = sides[f"{name}_min"], sides[f"{name}_max"]
        if _half_periodic(low.kind, high.kind):
            yield (
                f"{places.at('boundaries')}: {name}_min is {low.kind} and {name}_max is "
                f"{high.kind}. Make both of them periodic or neither."
            )
        for side, table in ((f"{name}_min", low), (f"{name}_max", high)):
            if axis == 2 and slab and table.kind != "closed":
                yield (
                    f"{places.at('boundaries', side)} is {table.kind}, but a scene of 2 dimensions "
                    "has no sides in z. Drop it."
                )
            if isinstance(table, NoSlipSide) and table.velocity[axis] != 0.0:
                yield (
                    f"{places.at('boundaries', side)}: velocity {list(table.velocity)} moves the "
                    f"wall out of its place. Make its {name} component 0."
                )


def check_outlet(
    places: Places, boundaries: BoundariesTable, domain: Domain, rates: Iterable[float]
) -> Iterator[str]:
    """Fluid that comes in must be able to leave.

    rates  volume rates of the sources, m^3/s
    """
    kinds = {name: side.kind for name, side in boundaries}
    unclear = any(_half_periodic(kinds[f"{a}_min"], kinds[f"{a}_max"]) for a in "xyz")
    if unclear or "open" in kinds.values():
        return
    total, largest = 0.0, 0.0
    for name, side in boundaries:
        if isinstance(side, InflowSide):
            axis = "xyz".index(name[0])
            others = [e for i, e in enumerate(domain.extent()) if i != axis]
            inward = 1.0 if name.endswith("min") else -1.0
            flux = inward * side.velocity[axis] * math.prod(others)
            total, largest = total + flux, max(largest, abs(flux))
    for rate in rates:
        total, largest = total + rate, max(largest, abs(rate))
    if abs(total) > 1e-9 * largest:
        yield (
            f"{places.at('boundaries')}: {total:+g} m^{len(domain.lower)}/s enters through inflow "
            "sides and sources, and no side is open for as much to leave. Make a side open."
        )
