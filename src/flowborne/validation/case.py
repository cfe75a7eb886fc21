"""What a validation case is, and what it finds."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from time import perf_counter
from traceback import extract_tb
from typing import Any, Literal

import numpy as np

from flowborne import Array
from flowborne.validation.reference import entry

Value = float | str
Verdict = Literal["pass", "coarse", "fail", "unconfirmed"]
"""`coarse` is a figure outside its tolerance on a grid too coarse for it: no failure, as its case
is judged on its finest grids. A figure inside its tolerance passes on any grid."""

THE_RUN = "the run"
"""What a case that broke down is judged by; its figures were not measured."""


class Tier(StrEnum):
    """How long a validation takes on two cores; each tier takes in those before it."""

    MINUTE = "minute"
    HALF_HOUR = "half-hour"
    ALL = "all"

    def within(self, wanted: Tier) -> bool:
        """Whether what belongs to this tier is run when `wanted` is asked for."""
        tiers = tuple(Tier)
        return tiers.index(self) <= tiers.index(wanted)


@dataclass(frozen=True)
class GridSeries:
    """A figure and its error from grid to grid.

    label   what the resolution counts, such as "cells across D"
    cells   resolutions, from coarse to fine
    values  the figure on each
    errors  its error on each, not negative
    """

    label: str
    cells: Sequence[float]
    values: Sequence[float]
    errors: Sequence[float]

    @property
    def order(self) -> float:
        """Slope of log error over log spacing, fitted to all grids; NaN where there is none."""
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
        """The series for people."""
        rows = [
            f"{cells:>6g} {self.label}: {value:.6g}, error {error:.3g}"
            for cells, value, error in zip(self.cells, self.values, self.errors, strict=True)
        ]
        if len(self.cells) > 1:
            rows.append(f"observed order {self.order:.2f}")
        return rows

    def as_dict(self) -> dict[str, Any]:
        """The same for programs; an order that does not exist is None."""
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
    """Points (x, y) of a plot; published ones stand beside those that were measured."""

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

    tolerance  how far from the reference still counts, in words or as a number
    lines      more for people
    plot       the curve that the quantity was read from, beside the published one
    confirmed  False where the list has the reference from memory: the finding does not count
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
        """How the finding is judged; `coarse` says that the run has grids too coarse for its case.

        Only a figure that was followed over grids can be coarse; all others hold on any grid.
        """
        if not self.confirmed:
            return "unconfirmed"
        if self.passed:
            return "pass"
        return "coarse" if coarse and self.series is not None else "fail"


def near(
    quantity: str,
    value: float,
    reference: float,
    *,
    relative: float | None = None,
    absolute: float | None = None,
    falling: GridSeries | None = None,
    series: GridSeries | None = None,
    lines: Iterable[str] = (),
) -> Finding:
    """A finding that passes within a relative or an absolute tolerance of its reference.

    falling  a grid series whose error has to fall from grid to grid besides
    series   a grid series that is shown and no more
    """
    bound = relative * abs(reference) if relative is not None else absolute
    assert bound is not None
    passed = abs(value - reference) <= bound
    said = f"{100.0 * relative:g} %" if relative is not None else f"{bound:g}"
    if falling is not None:
        passed = passed and falling.falls
        said += ", falling from grid to grid"
    shown = falling or series
    return Finding(quantity, float(value), reference, said, bool(passed), shown, tuple(lines))


def at_most(
    quantity: str,
    value: float,
    bound: float,
    *,
    series: GridSeries | None = None,
    lines: Iterable[str] = (),
) -> Finding:
    """A finding whose reference is 0 and whose size has to stay within `bound`."""
    return Finding(
        quantity, float(value), 0.0, f"{bound:g}", bool(abs(value) <= bound), series, tuple(lines)
    )


def order_of(
    quantity: str,
    series: GridSeries,
    *,
    least: float | None = None,
    expected: float | None = None,
    within: float = 0.2,
) -> Finding:
    """A finding about an order of convergence: at least `least`, or `expected` with a margin."""
    order = series.order
    if least is not None:
        return Finding(quantity, order, 2.0, f">= {least:g}", bool(order >= least), series)
    assert expected is not None
    passed = bool(abs(order - expected) <= within and series.falls)
    return Finding(quantity, order, expected, f"{within:g}", passed, series)


@dataclass(frozen=True)
class Result:
    """A finding with the case that it belongs to.

    id        of the case in the reference list
    tier      that the run belongs to
    quantity  which of its quantities
    seconds   that the whole case took
    finest    whether the run is the longest of its case, which has its finest grids
    """

    id: str
    tier: Tier
    title: str
    quantity: str
    value: Value
    reference: Value
    tolerance: Value
    verdict: Verdict
    lines: list[str]
    seconds: float
    finest: bool
    series: GridSeries | None = None
    plot: Plot | None = None

    @property
    def grid(self) -> str | None:
        """The grid on which the figure was measured; None if it was not followed over grids."""
        return None if self.series is None else self.series.finest

    def as_dict(self) -> dict[str, Any]:
        """Ready for JSON; a value that is not finite becomes its name."""
        row: dict[str, Any] = {
            "id": self.id,
            "tier": self.tier.value,
            "title": self.title,
            "quantity": self.quantity,
            "value": _plain(self.value),
            "reference": _plain(self.reference),
            "tolerance": _plain(self.tolerance),
            "verdict": self.verdict,
            "lines": self.lines,
            "seconds": self.seconds,
            "grid": self.grid,
            "finest": self.finest,
        }
        if self.series is not None:
            row["series"] = self.series.as_dict()
        if self.plot is not None:
            row["plot"] = self.plot.as_dict()
        return row

    @classmethod
    def from_dict(cls, row: dict[str, Any]) -> Result:
        """The result that `as_dict` gave."""
        found = {name: value for name, value in row.items() if name != "grid"}
        if "series" in found:
            series = {
                name: found["series"][name] for name in ("label", "cells", "values", "errors")
            }
            found["series"] = GridSeries(**series)
        if "plot" in found:
            plot = found["plot"]
            found["plot"] = Plot(plot["x"], plot["y"], [Curve(**curve) for curve in plot["curves"]])
        return cls(**{**found, "tier": Tier(found["tier"])})


@dataclass(frozen=True)
class Case:
    """A case of the reference list.

    id       in the list
    measure  runs the case and gives its findings; True asks for coarser grids and shorter runs
    quick    smallest tier that has the shorter run
    full     smallest tier that has the whole one
    coarse   whether the shorter run's grids are too coarse for the tolerances of the source
    alone    whether it measures seconds, so that no other case may run beside it
    """

    id: str
    measure: Callable[[bool], list[Finding]]
    quick: Tier = Tier.MINUTE
    full: Tier = Tier.ALL
    coarse: bool = False
    alone: bool = False

    @property
    def title(self) -> str:
        return entry(self.id).name

    @property
    def source(self) -> str:
        return entry(self.id).source

    def tier_in(self, wanted: Tier) -> Tier | None:
        """The largest of the case's tiers that is run in `wanted`; None where it has none there."""
        has = (self.full, self.quick)
        return next((tier for tier in has if tier.within(wanted)), None)

    def run(self, quick: bool = False) -> list[Result]:
        """Measure and judge. A run that breaks down is a failed result, with the cause."""
        started = perf_counter()
        try:
            findings = self.measure(quick)
        except Exception as error:  # whatever it is, the other cases go on
            return [self.broken(quick, _said(error), perf_counter() - started)]
        seconds = perf_counter() - started
        return [self._result(finding, quick, seconds) for finding in findings]

    def broken(self, quick: bool, cause: str, seconds: float = 0.0) -> Result:
        """The failed result of a run without figures."""
        return self._result(Finding(THE_RUN, cause, "ends", "", False), quick, seconds)

    def _result(self, finding: Finding, quick: bool, seconds: float) -> Result:
        verdict = finding.verdict(coarse=quick and self.coarse)
        lines = list(finding.series.lines()) if finding.series is not None else []
        if verdict == "coarse":
            lines.append(f"coarse: the case is judged on finer grids, by --tier {self.full.value}")
        return Result(
            self.id,
            self.quick if quick else self.full,
            f"{self.title}: {finding.quantity}",
            finding.quantity,
            finding.value,
            finding.reference,
            finding.tolerance,
            verdict,
            lines + list(finding.lines),
            seconds,
            not quick,
            finding.series,
            finding.plot,
        )


def _said(error: Exception) -> str:
    """What broke a run: of a flow that blew up its message, of all else kind and place, too."""
    if isinstance(error, ArithmeticError):
        return str(error)
    last = extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__}: {error} ({Path(last.filename).name}, line {last.lineno})"


def _plain(value: Value) -> Value:
    if isinstance(value, str) or np.isfinite(value):
        return value
    return str(value)
