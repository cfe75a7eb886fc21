"""Tables of a scene that describe the fluid: domain, fluid, boundaries, sources, dye."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, Self

from pydantic import Field, Strict, model_validator

from flowborne.tables import (
    ByKind,
    Corner,
    Count,
    NotNegative,
    Number,
    Positive,
    Table,
    Text,
    Vector,
)

Side = Literal["x_min", "x_max", "y_min", "y_max", "z_min", "z_max"]

MOST_BANDS = 1000
"""Bands of dye through a side."""

FEWEST_CELLS = 4
"""Cells that a domain has at least along each axis."""


class Domain(Table):
    """[domain]: the box of fluid. A scene without it has no fluid.

    lower, upper  corners in m; instead of them `origin` (the lower corner, 0 unless given) and
                  `size` may be given
    resolution    cells along the longest side; the other sides are rounded up to whole cells
    cells         instead of `resolution`: cells along each axis
    """

    lower: Corner
    upper: Corner
    resolution: Count | None = None
    cells: tuple[Count, ...] | None = None

    @model_validator(mode="before")
    @classmethod
    def _corners_from_size(cls, data: Any) -> Any:
        if not isinstance(data, dict) or not {"size", "origin"} & data.keys():
            return data
        data = dict(data)
        size, origin = data.pop("size", None), data.pop("origin", None)
        if {"lower", "upper"} & data.keys() or size is None:
            raise ValueError(
                "mixes two ways of saying where it is. Give lower and upper, or size (and origin)"
            )
        try:
            origin = [0.0] * len(size) if origin is None else origin
            upper = [float(a) + float(b) for a, b in zip(origin, size, strict=True)]
        except (TypeError, ValueError):
            raise ValueError(
                f"has origin {origin!r} and size {size!r}. Give both as lists of as many numbers"
            ) from None
        return {"lower": origin, "upper": upper, **data}

    @model_validator(mode="after")
    def _check(self) -> Self:
        if len(self.lower) != len(self.upper):
            raise ValueError(
                f"has lower = {list(self.lower)} and upper = {list(self.upper)}. "
                "Give both as many numbers"
            )
        for axis, low, high in zip("xyz", self.lower, self.upper, strict=False):
            if high <= low:
                raise ValueError(
                    f"reaches from {low:g} to {high:g} m in {axis}. "
                    "Make every number of upper larger than that of lower"
                )
        if (self.resolution is None) == (self.cells is None):
            raise ValueError(
                "needs a resolution. Give either resolution = cells along the longest side, "
                "or cells = a list with one number per axis"
            )
        if self.cells is not None:
            self._check_cells(self.cells)
        if min(self.counts()) < FEWEST_CELLS:
            raise ValueError(
                f"is too coarse with {' x '.join(map(str, self.counts()))} cells. "
                f"Refine it until every side has at least {FEWEST_CELLS} cells"
            )
        return self

    def _check_cells(self, cells: tuple[int, ...]) -> None:
        if len(cells) != len(self.lower):
            raise ValueError(
                f"has {len(cells)} numbers in cells and {len(self.lower)} in lower. "
                "Give one number of cells per axis"
            )
        edges = [e / n for e, n in zip(self.extent(), cells, strict=True)]
        if max(edges) - min(edges) > 1e-9 * max(edges):
            shown = " x ".join(f"{edge:.6g}" for edge in edges)
            raise ValueError(
                f"has cells of {shown} m, but cells are cubes. "
                "Change cells or the corners, or give resolution alone"
            )

    def extent(self) -> list[float]:
        """Length of each side as given, m."""
        return [high - low for low, high in zip(self.lower, self.upper, strict=True)]

    def spacing(self) -> float:
        """Edge of a cell, m."""
        if self.cells is not None:
            return self.extent()[0] / self.cells[0]
        assert self.resolution is not None
        return max(self.extent()) / self.resolution

    def counts(self) -> list[int]:
        """Cells along each axis."""
        if self.cells is not None:
            return list(self.cells)
        h = self.spacing()
        return [math.ceil(side / h * (1.0 - 1e-9)) for side in self.extent()]


class FluidTable(Table):
    """[fluid]: what fills the domain.

    density     kg/m^3
    viscosity   dynamic, Pa s; 0 is inviscid
    velocity    initial velocity everywhere, m/s
    body_force  uniform force per mass besides gravity, m/s^2
    advection   scheme that carries the velocity: "flux" keeps its momentum exactly, the paper's
                "semi-lagrangian" does not
    tolerance   relative residual at which the pressure solve stops
    coupling    "two-way": fluid and bodies push each other. "one-way": the fluid does not feel the
                bodies, and pushes them by winds of kind "stream". "none": it is left out, and those
                winds blow with their own velocity
    """

    density: Positive = 1000.0
    viscosity: NotNegative = 0.0
    velocity: Vector = (0.0, 0.0, 0.0)
    body_force: Vector = (0.0, 0.0, 0.0)
    advection: Literal["flux", "semi-lagrangian"] = "flux"
    tolerance: Annotated[float, Field(gt=0, lt=1)] = 1e-9
    coupling: Literal["two-way", "one-way", "none"] = "two-way"


class ClosedSide(Table):
    """Free-slip wall."""

    kind: Literal["closed"]


class NoSlipSide(Table):
    """Wall that the fluid sticks to.

    velocity  m/s with which it slides in its own plane
    """

    kind: Literal["no-slip"]
    velocity: Vector = (0.0, 0.0, 0.0)


class OpenSide(Table):
    """Fluid leaves and enters freely."""

    kind: Literal["open"]


class PeriodicSide(Table):
    """Joined to the opposite side."""

    kind: Literal["periodic"]


class InflowSide(Table):
    """Fluid enters with a given velocity.

    velocity  m/s; with profile "parabolic" its mean over the side
    profile   "uniform", or "parabolic" (0 at the edges of the side)
    ramp      s over which it rises smoothly from rest
    times     s, instead of ramp: keyframes between which `factors` of the velocity change smoothly
    factors   of the velocity at these times
    """

    kind: Literal["inflow"]
    velocity: Vector
    profile: Literal["uniform", "parabolic"] = "uniform"
    ramp: NotNegative = 0.0
    times: tuple[Number, ...] | None = None
    factors: tuple[Number, ...] | None = None

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.times is None and self.factors is None:
            return self
        if self.ramp > 0.0:
            raise ValueError("has both a ramp and keyframes. Keep one of them")
        check_table(self.times, self.factors, "times", "factors")
        return self


def check_table(
    times: tuple[float, ...] | None, values: tuple[float, ...] | None, first: str, second: str
) -> None:
    """Raise ValueError unless both are given, are equally long, and the times increase."""
    if times is None or values is None:
        missing = first if times is None else second
        raise ValueError(f"has no {missing}. Give both {first} and {second}")
    if len(times) != len(values):
        raise ValueError(
            f"has {len(times)} {first} and {len(values)} {second}. Give as many of both"
        )
    if len(times) < 2:
        raise ValueError(f"has {len(times)} {first}. Give at least two")
    for index in range(1, len(times)):
        if times[index] <= times[index - 1]:
            raise ValueError(
                f"has {first} that do not increase: entry {index + 1} is {times[index]:g} s after "
                f"{times[index - 1]:g} s. Put them in order, each once"
            )


def check_interval(start: float, stop: float | None) -> None:
    """Raise ValueError unless something lies between `start` and `stop`."""
    if stop is not None and stop <= start:
        raise ValueError(f"starts at {start:g} s and stops at {stop:g} s. Make stop later")


def check_box(lower: tuple[float, ...], upper: tuple[float, ...]) -> None:
    """Raise ValueError unless the box has an inside."""
    for axis, low, high in zip("xyz", lower, upper, strict=False):
        if high <= low and not (axis == "z" and low == high == 0.0):
            raise ValueError(
                f"is a box from {low:g} to {high:g} m in {axis}. Make upper larger than lower"
            )


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


class SourceTable(Table):
    """[[sources]]: a box inside the domain where fluid appears or is driven.

    lower, upper  corners, m
    volume_rate   m^3/s (m^2/s in two dimensions) that appears; negative drains
    velocity      instead: m/s that the fluid has in the box
    dye           name -> value that a dye has in the box
    start, stop   s
    """

    lower: Vector
    upper: Vector
    volume_rate: Number | None = None
    velocity: Vector | None = None
    dye: dict[str, Number] = Field(default_factory=dict)
    start: Number = 0.0
    stop: Number | None = None

    @model_validator(mode="after")
    def _check(self) -> Self:
        check_box(self.lower, self.upper)
        check_interval(self.start, self.stop)
        if (self.volume_rate is None) == (self.velocity is None):
            raise ValueError("needs one of volume_rate and velocity. Give exactly one of them")
        return self


class DyeBands(Table):
    """Dye that enters in bands through an inflow side.

    name         of the dye
    side         the inflow side
    count        number of bands, evenly spread over the side
    width        m, of each of them
    bands        instead of count: [from, to] of each band in m
    across       axis along which the bands follow each other: the first free one unless given
    value        that the dye has in them
    start, stop  s between which it enters
    """

    kind: Literal["bands"]
    name: Text = "dye"
    side: Side
    count: Annotated[int, Strict(), Field(ge=1, le=MOST_BANDS)] | None = None
    width: Positive | None = None
    bands: tuple[tuple[Number, Number], ...] | None = None
    across: Literal["x", "y", "z"] | None = None
    value: Number = 1.0
    start: Number = 0.0
    stop: Number | None = None

    @model_validator(mode="after")
    def _check(self) -> Self:
        check_interval(self.start, self.stop)
        if (self.bands is None) == (self.count is None or self.width is None):
            raise ValueError(
                "needs its places. Give count and width, or bands = a list of [from, to]"
            )
        for low, high in self.bands or ():
            if high <= low:
                raise ValueError(
                    f"has a band from {low:g} to {high:g} m. Put the smaller number first"
                )
        if self.across == self.side[0]:
            raise ValueError(
                f"has across = '{self.across}', but side {self.side} is at right angles to it. "
                "Choose another axis"
            )
        return self


class DyeBox(Table):
    """Dye that is always present in a box inside the domain.

    name          of the dye
    lower, upper  corners, m
    value         that it has there
    start, stop   s between which it is kept there
    """

    kind: Literal["box"]
    name: Text = "dye"
    lower: Vector
    upper: Vector
    value: Number = 1.0
    start: Number = 0.0
    stop: Number | None = None

    @model_validator(mode="after")
    def _check(self) -> Self:
        check_box(self.lower, self.upper)
        check_interval(self.start, self.stop)
        return self


DyeTable = Annotated[DyeBands | DyeBox, *ByKind]
