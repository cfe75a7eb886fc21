"""What a validation case is, and what it finds."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np

from flowborne.validation.reference import entry

Value = float | str


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
class Finding:
    """One quantity of a case, measured and judged.

    tolerance  how far from the reference still counts, in words or as a number
    lines      more for people
    """

    quantity: str
    value: Value
    reference: Value
    tolerance: Value
    passed: bool
    series: GridSeries | None = None
    lines: tuple[str, ...] = ()


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
    quantity  which of its quantities
    verdict   "pass" or "fail"
    seconds   that the whole case took
    """

    id: str
    title: str
    quantity: str
    value: Value
    reference: Value
    tolerance: Value
    verdict: str
    lines: list[str]
    seconds: float
    series: GridSeries | None = None

    def as_dict(self) -> dict[str, Any]:
        """Ready for JSON; a value that is not finite becomes its name."""
        row: dict[str, Any] = {
            "id": self.id,
            "title": self.title,
            "quantity": self.quantity,
            "value": _plain(self.value),
            "reference": _plain(self.reference),
            "tolerance": _plain(self.tolerance),
            "verdict": self.verdict,
            "lines": self.lines,
            "seconds": self.seconds,
        }
        if self.series is not None:
            row["series"] = self.series.as_dict()
        return row


@dataclass(frozen=True)
class Case:
    """A case of the reference list.

    id       in the list
    measure  runs the case and gives its findings; True asks for coarser grids and shorter runs
    """

    id: str
    measure: Callable[[bool], list[Finding]]

    @property
    def title(self) -> str:
        return entry(self.id).name

    @property
    def source(self) -> str:
        return entry(self.id).source

    def run(self, quick: bool = False) -> list[Result]:
        """Measure and judge. A run that breaks down is a failed result, with the cause."""
        started = perf_counter()
        try:
            findings = self.measure(quick)
        except ArithmeticError as error:
            findings = [Finding("the run", str(error), "ends", "", False)]
        seconds = perf_counter() - started
        return [self._result(finding, seconds) for finding in findings]

    def _result(self, finding: Finding, seconds: float) -> Result:
        lines = list(finding.series.lines()) if finding.series is not None else []
        return Result(
            self.id,
            f"{self.title}: {finding.quantity}",
            finding.quantity,
            finding.value,
            finding.reference,
            finding.tolerance,
            "pass" if finding.passed else "fail",
            lines + list(finding.lines),
            seconds,
            finding.series,
        )


def _plain(value: Value) -> Value:
    if isinstance(value, str) or np.isfinite(value):
        return value
    return str(value)
