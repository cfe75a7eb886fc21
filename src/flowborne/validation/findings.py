"""Findings of validation cases: quantities on one or several grids, measured and judged."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from flowborne import Array

Value = float | str
Verdict = Literal["pass", "coarse", "fail", "unconfirmed"]
"""`coarse` is a figure outside its tolerance on a grid too coarse for it. This is no failure, as a
case is judged on its finest grids. A figure inside its tolerance passes on any grid."""


@dataclass(frozen=True)
class GridSeries:
    """A figure and its error from grid to grid.

    label   unit of the resolution, such as "cells across D"
    cells   resolutions, from coarse to fine
    values  the figure on each
    errors  its error on each, not negative
    """

    label: str
    cells: Sequence[float]
    values: Sequence[float]
    errors: Sequence[float]

    @classmethod
    def toward(
        cls,
        label: str,
        cells: Sequence[float],
        values: Sequence[float] | Array,
        exact: float,
        relative: bool = False,
    ) -> GridSeries:
        """A series with the errors |value - exact|, or, if `relative`, |value / exact - 1|."""
        errors = [abs(value / exact - 1.0 if relative else value - exact) for value in values]
        return cls(label, cells, list(values), errors)

    @property
    def order(self) -> float:
        """Slope of log error over log spacing, fitted to all grids; NaN if it does not exist."""
        if len(self.cells) < 2 or not min(self.errors) > 0.0:
            return float("nan")
        return float(-np.polyfit(np.log(self.cells), np.log(self.errors), 1)[0])

    @property
    def finest(self) -> str:
        """The last of the grids, such as "10 cells across D"."""
        return f"{self.cells[-1]:g} {self.label}"

    @property
    def falls(self) -> bool:
        """Whether the error falls from each grid to the next."""
        return bool(np.all(np.diff(self.errors) < 0.0))

    def lines(self) -> list[str]:
        """The series as text."""
        rows = [
            f"{cells:>6g} {self.label}: {value:.6g}, error {error:.3g}"
            for cells, value, error in zip(self.cells, self.values, self.errors, strict=True)
        ]
        if len(self.cells) > 1:
            rows.append(f"observed order {self.order:.2f}")
        return rows

    def as_dict(self) -> dict[str, Any]:
        """Ready for JSON; an order that does not exist is None."""
        order = self.order
        return {
            "label": self.label,
            "cells": [float(c) for c in self.cells],
            "values": [float(v) for v in self.values],
            "errors": [float(e) for e in self.errors],
            "order": order if np.isfinite(order) else None,
        }


@dataclass(frozen=True)
class Curve:
    """Points (x, y) of a plot, measured or published."""

    label: str
    x: Sequence[float] | Array
    y: Sequence[float] | Array
    published: bool = False

    def as_dict(self) -> dict[str, Any]:
        """Ready for JSON, to the five digits that a plot can show."""
        return {
            "label": self.label,
            "x": [float(f"{value:.5g}") for value in self.x],
            "y": [float(f"{value:.5g}") for value in self.y],
            "published": self.published,
        }


@dataclass(frozen=True)
class Plot:
    """Curves over the same axes; x and y name them with their units."""

    x: str
    y: str
    curves: Sequence[Curve]

    def as_dict(self) -> dict[str, Any]:
        """Ready for JSON."""
        return {"x": self.x, "y": self.y, "curves": [curve.as_dict() for curve in self.curves]}


@dataclass(frozen=True)
class Finding:
    """One quantity of a case, measured and judged.

    tolerance  accepted distance from the reference, in words or as a number
    lines      details for people
    plot       the curve of which the quantity is a figure, and the published one
    confirmed  False if the list has the reference from memory: the finding does not count
    """

    quantity: str
    value: Value
    reference: Value
    tolerance: Value
    passed: bool
    series: GridSeries | None = None
    lines: tuple[str, ...] = ()
    plot: Plot | None = None
    confirmed: bool = True

    def verdict(self, coarse: bool = False) -> Verdict:
        """The verdict in a run; `coarse` says that the run's grids are too coarse for the case.

        Only a figure with a grid series can be coarse; all others hold on any grid.
        """
        if not self.confirmed:
            return "unconfirmed"
        if self.passed:
            return "pass"
        return "coarse" if coarse and self.series is not None else "fail"


FALLING = ", falling from grid to grid"


def near(
    quantity: str,
    value: float | GridSeries,
    reference: float,
    *,
    relative: float | None = None,
    absolute: float | None = None,
    falling: bool = False,
    series: GridSeries | None = None,
    lines: Iterable[str] = (),
) -> Finding:
    """A finding that passes within a relative or an absolute tolerance of its reference.

    value    a number, or a series of which the last value counts
    falling  whether the errors of the series have to fall from grid to grid, too
    series   shown with a number
    """
    value, series = _last_of(value, series)
    bound = relative * abs(reference) if relative is not None else absolute
    assert bound is not None
    passed = abs(value - reference) <= bound
    tolerance = f"{100.0 * relative:g} %" if relative is not None else f"{bound:g}"
    if falling:
        assert series is not None
        passed, tolerance = passed and series.falls, tolerance + FALLING
    return Finding(quantity, value, reference, tolerance, bool(passed), series, tuple(lines))


def within(
    quantity: str,
    series: GridSeries,
    reference: float,
    interval: tuple[float, float],
    *,
    falling: bool = False,
    lines: Iterable[str] = (),
    plot: Plot | None = None,
    confirmed: bool = True,
) -> Finding:
    """A finding whose last value has to lie in an interval.

    falling  whether the errors of the series have to fall from grid to grid, too
    """
    value, (low, high) = series.values[-1], interval
    tolerance = f"[{low:g}, {high:g}]" + (FALLING if falling else "")
    passed = low <= value <= high and (series.falls or not falling)
    return Finding(
        quantity, value, reference, tolerance, passed, series, tuple(lines), plot, confirmed
    )


def at_most(
    quantity: str,
    value: float | GridSeries,
    bound: float,
    *,
    series: GridSeries | None = None,
    lines: Iterable[str] = (),
) -> Finding:
    """A finding whose reference is 0 and whose size may be at most `bound`.

    value   a number, or a series of which the last value counts
    series  shown with a number
    """
    value, series = _last_of(value, series)
    return Finding(
        quantity, value, 0.0, f"{bound:g}", bool(abs(value) <= bound), series, tuple(lines)
    )


def _last_of(
    value: float | GridSeries, series: GridSeries | None
) -> tuple[float, GridSeries | None]:
    if isinstance(value, GridSeries):
        return float(value.values[-1]), value
    return float(value), series


def order_of(
    quantity: str,
    series: GridSeries,
    *,
    least: float | None = None,
    expected: float | None = None,
    within: float = 0.2,
) -> Finding:
    """A finding about an order of convergence: at least `least`, or `expected` to a margin."""
    order = series.order
    if least is not None:
        return Finding(quantity, order, 2.0, f">= {least:g}", bool(order >= least), series)
    assert expected is not None
    passed = bool(abs(order - expected) <= within and series.falls)
    return Finding(quantity, order, expected, f"{within:g}", passed, series)
