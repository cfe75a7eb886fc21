"""Sources and dye of a scene's fluid: their tables, checks and builders."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Annotated, Any, Literal, Self

from pydantic import Field, Strict, model_validator

from flowborne.base.tables import (
    ByKind,
    Number,
    Places,
    Positive,
    Table,
    Text,
    Vector,
    as_interval,
    check_interval,
    triple,
)
from flowborne.fluid.boundary import Source
from flowborne.fluid.grid import Grid
from flowborne.motion.inflow import Bands, even_bands
from flowborne.scenes.domain import Domain
from flowborne.scenes.sides import BoundariesTable, Side

MOST_BANDS = 1000
"""Bands of dye through a side."""


class BoxTable(Table):
    """A box inside the domain where something holds for a time.

    lower, upper  corners, m
    start, stop   s between which it holds
    """

    lower: Vector
    upper: Vector
    start: Number = 0.0
    stop: Number | None = None

    @model_validator(mode="after")
    def _check_place(self) -> Self:
        for axis, low, high in zip("xyz", self.lower, self.upper, strict=True):
            if high <= low and not (axis == "z" and low == high == 0.0):
                raise ValueError(
                    f"is a box from {low:g} to {high:g} m in {axis}. Make upper larger than lower"
                )
        check_interval(self.start, self.stop)
        return self

    def source(self, scalars: dict[str, float], **flow: Any) -> Source:
        """A source in the box."""
        lower, upper = triple(self.lower), triple(self.upper)
        times = as_interval(self.start, self.stop)
        return Source(lower, upper, scalars=dict(scalars), times=times, **flow)

    def check(self, domain: Domain) -> Iterator[str]:
        """What is wrong with it in a domain."""
        spans = zip("xyz", self.lower, self.upper, domain.lower, domain.upper, strict=False)
        for axis, low, high, first, last in spans:
            if high <= first or low >= last:
                yield (
                    f"the box reaches from {low:g} to {high:g} m in {axis}, outside the domain "
                    f"from {first:g} to {last:g} m. Move it."
                )


class SourceTable(BoxTable):
    """[[sources]]: a box inside the domain where fluid appears or is driven.

    lower, upper  corners, m
    volume_rate   m^3/s (m^2/s in two dimensions) that appears; negative drains
    velocity      instead: m/s that the fluid has in the box
    dye           name -> value that a dye has in the box
    start, stop   s
    """

    volume_rate: Number | None = None
    velocity: Vector | None = None
    dye: dict[str, Number] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _check(self) -> Self:
        if (self.volume_rate is None) == (self.velocity is None):
            raise ValueError("needs one of volume_rate and velocity. Give exactly one of them")
        return self

    def build(self) -> Source:
        """The source."""
        velocity = None if self.velocity is None else triple(self.velocity)
        return self.source(self.dye, volume_rate=self.volume_rate, velocity=velocity)


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

    @property
    def axis(self) -> int:
        """Axis across which the bands follow each other."""
        return "xyz".index(self.across or ("x" if self.side[0] == "y" else "y"))

    def build(self, grid: Grid) -> Bands:
        """The bands on the side of a grid's domain."""
        low, high = grid.origin[self.axis], grid.upper[self.axis]
        ends = self.bands
        if ends is None:
            assert self.count is not None
            assert self.width is not None
            ends = even_bands(low, high, self.count, self.width)
        return Bands(self.axis, ends, self.value, as_interval(self.start, self.stop))


class DyeBox(BoxTable):
    """Dye that is always present in a box inside the domain.

    name          of the dye
    lower, upper  corners, m
    value         that it has there
    start, stop   s between which it is kept there
    """

    kind: Literal["box"]
    name: Text = "dye"
    value: Number = 1.0

    def build(self) -> Source:
        """The source that keeps the dye's value."""
        return self.source({self.name: self.value})


DyeTable = Annotated[DyeBands | DyeBox, *ByKind]


def check_bands(
    places: Places, dyes: Iterable[DyeTable], boundaries: BoundariesTable, domain: Domain
) -> Iterator[str]:
    sides = dict(boundaries)
    for index, dye in enumerate(dyes):
        if not isinstance(dye, DyeBands):
            continue
        where = places.at("dye", index)
        if not sides[dye.side].boundary.supplies:
            yield (
                f"{where}: side {dye.side} is {sides[dye.side].kind}, and dye enters with an "
                "inflow. Choose an inflow side, or use a dye of kind 'box'."
            )
        axis = dye.axis
        if axis >= len(domain.lower):
            yield f"{where} has across = 'z' in a scene of 2 dimensions. Choose another axis."
            continue
        low, high = domain.lower[axis], domain.upper[axis]
        for number, (start, stop) in enumerate(dye.bands or (), start=1):
            if stop <= low or start >= high:
                yield (
                    f"{where}, bands, entry {number}: [{start:g}, {stop:g}] m is beside the side, "
                    f"which reaches from {low:g} to {high:g} m. Move it."
                )
