"""Findings of validation cases: quantities on one or several grids, measured and judged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple, TypedDict, Unpack

import numpy as np

from flowborne import Array

Value = float | str
Verdict = Literal["pass", "coarse", "fail", "unconfirmed"]
"""`coarse` is a figure outside its tolerance on a grid too coarse for it. This is no failure, as a
case is judged on its finest grids. A figure inside its tolerance passes on any grid."""


Figures = Sequence[float] | Sequence[Sequence[float]] | Array
"""A figure on each of several grids, or in several places of a body in the cell on each."""


class Grids(NamedTuple):
    """Resolutions from coarse to fine, with their unit, such as "cells across D"."""

    label: str
    cells: Sequence[Any]


@dataclass(frozen=True)
class GridSeries:
    """A figure and its error from grid to grid; label and cells as in `Grids`.

    values  the figure on each grid
    errors  its error on each, not negative
    places  the figure in each place of a body in the cell, on each grid, if it has several places
    """

    label: str
    cells: Sequence[float]
    values: Sequence[float]
    errors: Sequence[float]
    places: Sequence[Sequence[float]] = ()

    @classmethod
    def toward(
        cls, grids: Grids, values: Figures, exact: float, relative: bool = False
    ) -> GridSeries:
        """A series with the errors |value - exact|, or, if `relative`, |value / exact - 1|.

        values  one on each grid, or several in different places of a body, whose mean counts
        """
        means = [float(np.mean(value)) for value in values]
        errors = [abs(value / exact - 1.0 if relative else value - exact) for value in means]
        places = [list(np.atleast_1d(value)) for value in values] if np.ndim(values[0]) else ()
        return cls(*grids, means, errors, places)

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
        for n, found in enumerate(self.places):
            rows[n] += f", {spread_of(found)}, from {min(found):.6g} to {max(found):.6g}"
        if len(self.cells) > 1 and np.isfinite(self.order):
            rows.append(f"observed order {self.order:.2f}")
        elif len(self.cells) > 1:
            rows.append("no observed order: an error is not positive")
        return rows

    def as_dict(self) -> dict[str, Any]:
        """Ready for JSON; an order that does not exist is None."""
        order = self.order
        places = [[float(v) for v in found] for found in self.places]
        return ({"places": places} if places else {}) | {
            "label": self.label,
            "cells": [float(c) for c in self.cells],
            "values": [float(v) for v in self.values],
            "errors": [float(e) for e in self.errors],
            "order": order if np.isfinite(order) else None,
        }


def spread_of(places: Sequence[float]) -> str:
    """The largest difference of a figure over the places of a body in the cell, in words."""
    if len(places) == 1:
        return "in one place"
    return f"mean of {len(places)} places with a spread of {np.ptp(places):.2g}"


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
    lines: Sequence[str] = ()
    plot: Plot | None = None
    confirmed: bool = True

    def verdict(self, coarse: bool = False) -> Verdict:
        """The verdict in a run; `coarse` says that the run's grids are too coarse for the case.
        Only a figure with a grid series can be coarse; all others hold on any grid."""
        if not self.confirmed:
            return "unconfirmed"
        if self.passed:
            return "pass"
        return "coarse" if coarse and self.series is not None else "fail"


class Details(TypedDict, total=False):
    """Values of a `Finding` besides or in place of those that a function gives it."""

    tolerance: Value
    series: GridSeries | None
    lines: Sequence[str]
    plot: Plot | None
    confirmed: bool


Measured = float | Figures | GridSeries
"""A number; figures on several grids, of which the last counts; or a series of them."""


def near(
    quantity: str,
    value: Measured,
    reference: float,
    on: Grids | None = None,
    *,
    relative: float | None = None,
    absolute: float | None = None,
    **details: Unpack[Details],
) -> Finding:
    """A finding that passes within a relative or an absolute tolerance of its reference.

    on  the grids of several figures
    """
    figure, series = _figure(value, reference, on)
    bound = relative * abs(reference) if relative is not None else absolute
    assert bound is not None
    passed = bool(abs(figure - reference) <= bound)
    tolerance = f"{100.0 * relative:g} %" if relative is not None else f"{bound:g}"
    return replace(Finding(quantity, figure, reference, tolerance, passed, series), **details)


def within(
    quantity: str,
    values: Figures,
    reference: float,
    interval: tuple[float, float],
    on: Grids,
    **details: Unpack[Details],
) -> Finding:
    """A finding on several grids whose last value has to lie in an interval."""
    value, series = _figure(values, reference, on)
    low, high = interval
    found = Finding(
        quantity, value, reference, f"[{low:g}, {high:g}]", low <= value <= high, series
    )
    return replace(found, **details)


def falling(found: Finding) -> Finding:
    """The finding, which passes only if its errors fall from grid to grid, too."""
    assert found.series is not None
    tolerance = f"{found.tolerance}, falling from grid to grid"
    return replace(found, tolerance=tolerance, passed=found.passed and found.series.falls)


def at_most(
    quantity: str,
    value: Measured,
    bound: float,
    on: Grids | None = None,
    **details: Unpack[Details],
) -> Finding:
    """A finding whose reference is 0 and whose size may be at most `bound`."""
    return near(quantity, value, 0.0, on, absolute=bound, **details)


def above(
    quantity: str, value: float, bound: float, tolerance: str, lines: Sequence[str] = ()
) -> Finding:
    """A finding that passes above a bound; `tolerance` says what that means, such as "sign"."""
    passed = bool(value > bound)
    return Finding(quantity, value, f"> {bound:g}", tolerance, passed, lines=lines)


def _figure(value: Measured, exact: float, on: Grids | None) -> tuple[float, GridSeries | None]:
    """The figure that counts, and its series."""
    if on is not None:
        assert isinstance(value, Sequence | np.ndarray)
        value = GridSeries.toward(on, value, exact)
    if isinstance(value, GridSeries):
        return float(value.values[-1]), value
    assert not isinstance(value, Sequence | np.ndarray)
    return float(value), None


def order_of(
    quantity: str, series: GridSeries, *, least: float | None = None, expected: float | None = None
) -> Finding:
    """A finding about an order of convergence: at least `least`, or `expected` to 0.2."""
    order = series.order
    if least is not None:
        return Finding(quantity, order, 2.0, f">= {least:g}", bool(order >= least), series)
    assert expected is not None
    passed = bool(abs(order - expected) <= 0.2 and series.falls)
    return Finding(quantity, order, expected, "0.2", passed, series)
