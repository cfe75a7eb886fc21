"""The cases of the reference list: their references, rules, runs and results."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from fnmatch import fnmatchcase
from functools import cache
from importlib.resources import files
from pathlib import Path
from time import perf_counter
from traceback import extract_tb
from typing import Any

import numpy as np

from flowborne_validation.findings import (
    Curve,
    Figure,
    Figures,
    GridSeries,
    Plot,
    Rule,
    Value,
    Verdict,
    figure_of,
)

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


@dataclass(frozen=True)
class Result:
    """A judged quantity of a case.

    id        of the case in the reference list
    tier      of the run
    quantity  of the case
    value     measured
    lines     details for people
    seconds   of the whole run
    finest    whether the run is the longest of its case, with its finest grids
    """

    id: str
    tier: Tier
    quantity: str
    value: Value
    reference: Value
    tolerance: str
    verdict: Verdict
    lines: Sequence[str]
    seconds: float
    finest: bool
    series: GridSeries | None = None
    plot: Plot | None = None

    @property
    def title(self) -> str:
        return f"{entry(self.id).name}: {self.quantity}"

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
        found = {name: value for name, value in row.items() if name not in ("title", "grid")}
        if "series" in row:
            given = {name: value for name, value in row["series"].items() if name != "order"}
            found["series"] = GridSeries(**given)
        if "plot" in row:
            plot = row["plot"]
            found["plot"] = Plot(plot["x"], plot["y"], [Curve(**curve) for curve in plot["curves"]])
        return cls(**{**found, "tier": Tier(row["tier"])})


@dataclass(frozen=True)
class Case:
    """A case of the reference list, as the table of cases has it.

    id      in the list
    runs    tier -> functions that measure; of two tiers, first that with the shorter run on coarser
            grids
    rules   quantity, in which * stands for any text -> how it is judged; the first that fits counts
    coarse  whether the shorter run's grids are too coarse for the tolerances of the source
    alone   whether it measures seconds, so that no other case may run at the same time
    """

    id: str
    runs: Mapping[Tier, Sequence[Callable[[], Figures]]]
    rules: Mapping[str, Rule]
    coarse: bool = False
    alone: bool = False

    @property
    def quick(self) -> Tier:
        """The smallest tier with the shorter run."""
        return next(iter(self.runs))

    @property
    def full(self) -> Tier:
        """The smallest tier with the whole run."""
        return tuple(self.runs)[1]

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
        found: dict[str, float | Figure] = {}
        try:
            for measure in self.runs[self.quick if quick else self.full]:
                found.update(measure())
        except Exception as error:  # the other cases continue
            return [self.broken(quick, _cause(error), perf_counter() - started)]
        return self.judge(found, quick, perf_counter() - started)

    def broken(self, quick: bool, cause: str, seconds: float = 0.0) -> Result:
        """The failed result of a run without figures."""
        tier = self.quick if quick else self.full
        return Result(self.id, tier, THE_RUN, cause, "ends", "", "fail", [], seconds, not quick)

    def judge(self, found: Figures, quick: bool = False, seconds: float = 0.0) -> list[Result]:
        """Judge figures by the table. Only one with a grid series can be coarse; all others hold on
        any grid."""
        return [self._result(name, figure_of(f), quick, seconds) for name, f in found.items()]

    def _result(self, quantity: str, figure: Figure, quick: bool, seconds: float) -> Result:
        rule = next(rule for name, rule in self.rules.items() if fnmatchcase(quantity, name))
        rule, listed = replace(rule, **figure.judged), entry(self.id)
        exact = rule.reference_of(quantity, figure, listed.quantities)
        value, series = rule.value_of(figure, exact)
        exact = exact if rule.order is None else rule.order
        lines = [] if series is None else series.lines()
        verdict: Verdict = "pass"
        if (rule.known or quantity) in listed.memory:
            verdict = "unconfirmed"
        elif not rule.accepts(value, exact, series):
            verdict = "fail"
        if verdict == "fail" and quick and self.coarse and series is not None:
            verdict = "coarse"
            lines.append(f"coarse: the case is judged on finer grids, by --tier {self.full.value}")
        lines += figure.lines
        tier, judged = self.quick if quick else self.full, (value, exact, rule.accepted, verdict)
        found = (*judged, lines, seconds, not quick, series, figure.plot)
        return Result(self.id, tier, quantity, *found)


def _cause(error: Exception) -> str:
    """The message of an error; kind and line, too, unless a flow blew up."""
    if isinstance(error, ArithmeticError):
        return str(error)
    last = extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__}: {error} ({Path(last.filename).name}, line {last.lineno})"


def _plain(value: Any) -> Any:
    """The value, or the name of a number that is not finite."""
    return str(value) if isinstance(value, float) and not np.isfinite(value) else value
