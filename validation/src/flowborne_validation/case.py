"""The cases of the reference list, their references, and the results of their runs."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from importlib.resources import files
from pathlib import Path
from time import perf_counter
from traceback import extract_tb
from typing import Any

import numpy as np

from flowborne_validation.findings import Curve, Finding, GridSeries, Plot, Value, Verdict

THE_RUN = "the run"
"""Quantity of a case whose run broke down, without figures."""


class Tier(StrEnum):
    """How long a validation takes on two cores; each tier includes those before it."""

    MINUTE = "minute"
    HALF_HOUR = "half-hour"
    ALL = "all"

    def within(self, wanted: Tier) -> bool:
        """Whether a run of the tier `wanted` includes this tier."""
        tiers = tuple(Tier)
        return tiers.index(self) <= tiers.index(wanted)


@dataclass(frozen=True)
class Entry:
    """A case of the list.

    quantities  name -> value in the list: a number, a formula in words, or a table
    memory      names of quantities that were quoted from memory and not checked at their source
    """

    id: str
    name: str
    source: str
    provenance: str
    quantities: dict[str, Any]
    memory: Sequence[str] = ()


@cache
def entries() -> dict[str, Entry]:
    """All cases by their ids, in the order of the list."""
    text = files("flowborne_validation").joinpath("references.json").read_text(encoding="utf-8")
    return {case["id"]: Entry(**case) for case in json.loads(text)["cases"]}


def entry(case: str) -> Entry:
    """The entry of a case. Raises KeyError for an unknown id."""
    return entries()[case]


def reference(case: str, quantity: str) -> Any:
    """A quantity's value in the list. Raises KeyError when there is none."""
    return entry(case).quantities[quantity]


def table(case: str, quantity: str) -> dict[float, Any]:
    """A table of the list whose keys are numbers."""
    return {float(key): value for key, value in reference(case, quantity).items()}


def confirmed(case: str, quantity: str) -> bool:
    """Whether a quantity's value was checked at its source, or derived."""
    return quantity not in entry(case).memory


@dataclass(frozen=True)
class Result:
    """A finding of a case.

    id        of the case in the reference list
    tier      of the run
    quantity  of the case
    seconds   of the whole run
    finest    whether the run is the longest of its case, with its finest grids
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
        """The grid on which the figure was measured; None without a grid series."""
        return None if self.series is None else self.series.finest

    def as_dict(self) -> dict[str, Any]:
        """Ready for JSON; a value that is not finite becomes its name."""
        names = ["id", "tier", "title", "quantity", "value", "reference", "tolerance", "verdict"]
        names += ["lines", "seconds", "grid", "finest"]
        row = {name: _plain(getattr(self, name)) for name in names}
        parts = {"series": self.series, "plot": self.plot}
        return row | {name: part.as_dict() for name, part in parts.items() if part is not None}

    @classmethod
    def from_dict(cls, row: dict[str, Any]) -> Result:
        """The result that `as_dict` gave."""
        found = {name: value for name, value in row.items() if name != "grid"}
        if "series" in row:
            given = {name: value for name, value in row["series"].items() if name != "order"}
            found["series"] = GridSeries(**given)
        if "plot" in row:
            plot = row["plot"]
            found["plot"] = Plot(plot["x"], plot["y"], [Curve(**curve) for curve in plot["curves"]])
        return cls(**{**found, "tier": Tier(row["tier"])})


@dataclass(frozen=True)
class Case:
    """A case of the reference list.

    id       in the list
    measure  runs the case and returns its findings; True for coarser grids and shorter runs
    quick    smallest tier with the shorter run
    full     smallest tier with the whole run
    coarse   whether the shorter run's grids are too coarse for the tolerances of the source
    alone    whether it measures seconds, so that no other case may run at the same time
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

    def tier_in(self, wanted: Tier) -> Tier | None:
        """The largest of the case's tiers within `wanted`; None if there is none."""
        has = (self.full, self.quick)
        return next((tier for tier in has if tier.within(wanted)), None)

    def run(self, quick: bool = False) -> list[Result]:
        """Measure and judge. A run that breaks down is a failed result, with the cause."""
        started = perf_counter()
        try:
            findings = self.measure(quick)
        except Exception as error:  # the other cases continue
            return [self.broken(quick, _cause(error), perf_counter() - started)]
        seconds = perf_counter() - started
        return [self._result(finding, quick, seconds) for finding in findings]

    def broken(self, quick: bool, cause: str, seconds: float = 0.0) -> Result:
        """The failed result of a run without figures."""
        return self._result(Finding(THE_RUN, cause, "ends", "", False), quick, seconds)

    def _result(self, finding: Finding, quick: bool, seconds: float) -> Result:
        verdict = finding.verdict(coarse=quick and self.coarse)
        lines = [] if finding.series is None else finding.series.lines()
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
            [*lines, *finding.lines],
            seconds,
            not quick,
            finding.series,
            finding.plot,
        )


def _cause(error: Exception) -> str:
    """The message of an error; kind and line, too, unless a flow blew up."""
    if isinstance(error, ArithmeticError):
        return str(error)
    last = extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__}: {error} ({Path(last.filename).name}, line {last.lineno})"


def _plain(value: Any) -> Any:
    """The value, or the name of a number that is not finite."""
    return str(value) if isinstance(value, float) and not np.isfinite(value) else value
