"""What cases measure, figures on one or several grids and curves, and how it is judged."""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from flowborne import Array

Value = float | str
Verdict = Literal["pass", "coarse", "fail", "unconfirmed"]
"""`coarse` is a figure outside its tolerance on a grid too coarse for it. This is no failure, as a
case is judged on its finest grids. A figure inside its tolerance passes on any grid."""


@dataclass(frozen=True)
class GridSeries:
    """A figure and its error from grid to grid, from coarse to fine.

    label   unit of the grids, such as "cells across D"
    cells   the grids in it
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
        cls,
        label: str,
        cells: Sequence[float],
        values: Sequence[Any] | Array,
        exact: float,
        relative: bool = False,
    ) -> GridSeries:
        """A series with the errors |value - exact|, or, if `relative`, |value / exact - 1|.

        values  one on each grid, or several in different places of a body, whose mean counts
        """
        means = [float(np.mean(value)) for value in values]
        errors = [abs(value / exact - 1.0 if relative else value - exact) for value in means]
        places = [list(np.atleast_1d(value)) for value in values] if np.ndim(values[0]) else ()
        return cls(label, cells, means, errors, places)

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
class Figure:
    """A measured quantity.

    values     a number; or one on each of several grids, of which the last counts; or several on
               each, in different places of a body in the cell, whose mean counts
    cells      the grids, from coarse to fine
    reference  what it should be, if neither the table of cases nor the list of references has it
    value      the number that counts, if it is not the last one
    lines      details for people
    plot       the curve of which the quantity is a figure, and the published one
    judged     fields of its `Rule` that depend on the run
    on         unit of the grids
    """

    values: Any
    cells: Sequence[float] = ()
    reference: float | None = None
    value: float | None = None
    lines: Sequence[str] = ()
    plot: Plot | None = None
    judged: Mapping[str, Any] = field(default_factory=dict)
    on: str = ""


Figures = Mapping[str, float | Figure]
"""Quantity -> what was measured."""


def figure_of(found: float | Figure) -> Figure:
    """The figure, or the figure of a number."""
    return found if isinstance(found, Figure) else Figure(found)


def over(grids: Sequence[Any], measure: Callable[[Any], Figures]) -> dict[str, Figure]:
    """Figures of one grid after the other; all but the values is that of the last one.

    grids  a number, or cells along several axes, of which the first names the grid
    """
    runs = [{name: figure_of(f) for name, f in measure(grid).items()} for grid in grids]
    cells = [grid[0] if isinstance(grid, Sequence) else grid for grid in grids]
    return {
        name: replace(last, values=[run[name].values for run in runs], cells=cells)
        for name, last in runs[-1].items()
    }


def named(
    names: Sequence[str], values: Sequence[Any], cells: Sequence[float], lines: Sequence[str] = ()
) -> dict[str, Figure]:
    """Figures of several quantities on the same grids; the lines are those of the first."""
    found = {name: Figure(v, cells) for name, v in zip(names, values, strict=True)}
    return found | {names[0]: replace(found[names[0]], lines=lines)}


COMPARE = {">": operator.gt, ">=": operator.ge, "<": operator.lt, "<=": operator.le}


@dataclass(frozen=True)
class Rule:
    """How quantities are judged: a row of the table of cases.

    reference        a number, or a bound such as "> 0". By default that of the figure, or the
                     number in the list of references; if there is none, 0, or 1 for a relative
                     tolerance
    known            name of that number in the list, if it is not the quantity
    relative         accepted distance from the reference over its size
    absolute         accepted distance from the reference
    within           least and largest accepted value
    no_more          whether the value may be as large as the reference and no larger
    order            expected order of convergence, which is judged in place of the figure
    falling          whether errors have to fall from grid to grid, too
    relative_errors  whether the errors of the series are relative
    tolerance        in words, in place of those that the numbers give
    """

    reference: Value | None = None
    known: str | None = None
    relative: float | None = None
    absolute: float = np.inf
    within: tuple[float, float] | None = None
    no_more: bool = False
    order: float | None = None
    falling: bool = False
    relative_errors: bool = False
    tolerance: str | None = None

    def reference_of(self, quantity: str, figure: Figure, listed: Mapping[str, Any]) -> Value:
        """The reference of a figure; `listed` are the quantities in the list of references."""
        if figure.reference is not None:
            return figure.reference
        if self.reference is not None:
            return self.reference
        found: Value = listed.get(self.known or quantity, 1.0 if self.relative else 0.0)
        return found

    def value_of(self, figure: Figure, exact: Value) -> tuple[float, GridSeries | None]:
        """The number of a figure that is judged, and its grid series."""
        if not figure.cells:
            return float(figure.values), None
        aim = 0.0 if self.no_more or isinstance(exact, str) else exact
        shown = figure.on, figure.cells, figure.values
        series = GridSeries.toward(*shown, aim, self.relative_errors)
        last = series.values[-1] if figure.value is None else figure.value
        return last if self.order is None else series.order, series

    def accepts(self, value: float, exact: Value, series: GridSeries | None) -> bool:
        """Whether a value is near enough to its reference."""
        if self.falling and series is not None and not series.falls:
            return False
        if self.within is not None:
            return bool(self.within[0] <= value <= self.within[1])
        if isinstance(exact, str):
            sign, bound = exact.split()
            return bool(COMPARE[sign](value, float(bound)))
        if self.no_more:
            return bool(abs(value) <= exact)
        largest = self.absolute if self.relative is None else self.relative * abs(exact)
        return bool(abs(value - exact) <= largest)

    @property
    def accepted(self) -> str:
        """What is accepted, in words."""
        if self.tolerance is not None:
            return self.tolerance
        if self.within is not None:
            words = "[{:g}, {:g}]".format(*self.within)
        elif self.relative is not None:
            words = f"{100.0 * self.relative:g} %"
        else:
            words = f"{self.absolute:g}"
        return f"{words}, falling from grid to grid" if self.falling else words
