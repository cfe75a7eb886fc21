"""The result of a study: a table with a row for each of its runs."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from flowborne.base.atomic import replaced_whole
from flowborne.base.errors import SceneError
from flowborne.base.extras import optional
from flowborne.base.one_line import one_line
from flowborne.base.phrases import suggestion
from flowborne.kernels.arrays import Array, Integers
from flowborne.runs.history import unit_of
from flowborne.studies.error_bars import Refinement
from flowborne.studies.members import Ended, Members
from flowborne.studies.sampling import Sample
from flowborne.studies.schema import MeasureTable, Study, toml_text

Column = NDArray[Any]

TAKEN: dict[str, Callable[[Array], Any]] = {
    "mean": np.mean,
    "rms": lambda values: np.sqrt(np.mean(np.square(values))),
    "last": lambda values: values[-1],
    "least": np.min,
    "greatest": np.max,
}
"""How a number is taken of the frames -> function of (frames,) numbers."""

BAR = "_bar"
"""Ending of the column with the half width of a measure's error bar."""


@dataclass(frozen=True)
class Row:
    """A run of a study.

    sample      number of its sample, from 0
    member      name of its files
    settings    key -> value that distinguishes it from other runs
    is_finest   whether it has the finest resolutions of its sample
    ended       how it ended
    values      of the measures; nan for a failed run
    """

    sample: int
    member: str
    settings: Sample
    is_finest: bool
    ended: Ended
    values: tuple[float, ...]


@dataclass(frozen=True)
class StudyResult:
    """Result of a study; a row for each run.

    folder   of the study
    columns  name -> (runs,) values: `sample`, `member`, `finest`, the keys, `outcome`, `cells`, the
             measures, and with [[repeat]] half the width of their error bars, in the rows with the
             finest resolutions. Measures of failed runs are nan
    units    name -> unit; "1" without one, "" for keys, whose unit is that of the scene
    goals    name of a measure with a goal -> "least" or "most"
    failed   member -> what was wrong with it
    """

    __repr__ = one_line

    folder: Path
    columns: dict[str, Column]
    units: dict[str, str]
    goals: dict[str, str]
    failed: dict[str, str]

    def __len__(self) -> int:
        """Number of runs."""
        return len(self.columns["sample"])

    def front(self) -> Integers:
        """Rows of the Pareto front, of runs with the finest resolutions: no other one is as good in
        all goals and better in one. The best run if there is one goal.

        raises  ValueError without a goal
        """
        if not self.goals:
            raise ValueError("the study has no goal. Give a [[measure]] of it a goal.")
        signs = [1.0 if goal == "least" else -1.0 for goal in self.goals.values()]
        costs = np.column_stack([self.columns[name] for name in self.goals]) * signs
        rows = np.flatnonzero(self.columns["finest"] & np.isfinite(costs).all(axis=1))
        costs = costs[rows]
        beaten = [
            bool(((costs <= one).all(axis=1) & (costs < one).any(axis=1)).any()) for one in costs
        ]
        return rows[~np.array(beaten, bool)]

    def plot(self, x: str, y: str, path: str | Path | IO[bytes]) -> None:
        """Plot a column against another, with error bars and the Pareto front if there are any.

        x, y    names of columns of numbers; of runs with the finest resolutions
        path    .png, .svg or .pdf, overwritten; or an open file, which becomes SVG
        raises  ValueError for another column or format; SceneError if Matplotlib is not installed
        """
        optional("matplotlib", "Matplotlib", "film", "plots", "drawn")
        from flowborne.view.plots import plot_points

        points = self._axis(x), self._axis(y)
        front = self.front() if self.goals and {x, y} <= set(self.goals) else np.array([], int)
        finest = np.flatnonzero(self.columns["finest"])
        bar_columns = (self.columns.get(f"{name}{BAR}") for name in (x, y))
        x_bar, y_bar = (None if bar is None else bar[finest] for bar in bar_columns)
        labels = self.label(x), self.label(y)
        best = np.searchsorted(finest, front)
        plot_points(*points, (x_bar, y_bar), labels, best, path)

    def _axis(self, name: str) -> Array:
        if name not in self.columns or self.columns[name].dtype.kind not in "fiub":
            known = [n for n, values in self.columns.items() if values.dtype.kind in "fiub"]
            end = suggestion(name, known, "They are")
            raise ValueError(f"the study has no column of numbers '{name}'{end}")
        return self.columns[name][self.columns["finest"]].astype(float)

    def label(self, name: str) -> str:
        """Name of a column with its unit."""
        unit = self.units[name]
        return name if unit in ("", "1") else f"{name} ({unit})"

    def write(self, path: Path, about: Mapping[str, str]) -> None:
        """Write the table as Parquet, with the unit of each column in the metadata of its field."""
        arrow = optional("pyarrow", "pyarrow", "study", "tables of studies", "written")
        parquet = optional("pyarrow.parquet", "pyarrow", "study", "tables of studies", "written")
        arrays = {name: arrow.array(values.tolist()) for name, values in self.columns.items()}
        fields = [
            arrow.field(name, array.type, True, {"unit": self.units[name]})
            for name, array in arrays.items()
        ]
        schema = arrow.schema(fields, dict(about))
        with replaced_whole(path) as new:
            parquet.write_table(arrow.table(list(arrays.values()), schema=schema), new)


def measures_of(study: Study, columns: Sequence[str], file: str) -> tuple[MeasureTable, ...]:
    """The measures of a study; without any the mean of each column of the history.

    columns  of the history of its scene
    raises   SceneError for a column that is not in it, or several of different units
    """
    if not study.measure:
        names = [c for c in columns if c not in ("frame", "time_s")]
        return tuple(MeasureTable(name=f"mean {c}".replace("/", " per "), column=c) for c in names)
    for number, table in enumerate(study.measure, start=1):
        at = f"study {file}, [[measure]] {number}, column"
        found = matching(table.column, columns)
        if not found:
            end = suggestion(table.column, columns, "Its columns are")
            raise SceneError(f"{at}: the history has no column '{table.column}'{end}")
        if len({unit_of(column) for column in found}) > 1:
            raise SceneError(
                f"{at}: '{table.column}' is the sum of columns in different units: "
                f"{', '.join(found)}. Choose columns in one unit."
            )
    return study.measure


def matching(pattern: str, columns: Iterable[str]) -> list[str]:
    """Columns of a name, in which each `*` stands for any text."""
    form = re.compile(".*".join(map(re.escape, pattern.split("*"))))
    return [column for column in columns if form.fullmatch(column)]


def values_of(
    members: Members, name: str, measures: Sequence[MeasureTable], columns: Sequence[str]
) -> tuple[float, ...]:
    """Measures of a complete member; nan where its history has no such column or frame."""
    history = members.history(name, [*columns, "time_s"])
    found = []
    for table in measures:
        chosen = matching(table.column, [c for c in history if c in columns])
        frames = history["time_s"] > table.after
        if chosen and frames.any():
            total = np.sum([history[column][frames] for column in chosen], axis=0)
            found.append(float(table.factor * TAKEN[table.take](total)))
        else:
            found.append(math.nan)
    return tuple(found)


def table_of(
    study: Study, measures: Sequence[MeasureTable], rows: Sequence[Row], folder: Path
) -> StudyResult:
    """The table of all runs of a study."""
    columns: dict[str, Column] = {
        "sample": np.array([row.sample for row in rows], np.int64),
        "member": np.array([row.member for row in rows], object),
        "finest": np.array([row.is_finest for row in rows], bool),
    }
    for key in study.keys:
        columns[key] = _column([row.settings[key] for row in rows])
    columns["outcome"] = np.array([row.ended.outcome for row in rows], object)
    columns["cells"] = np.array([row.ended.cells for row in rows], float)
    units = {name: "" if "." in name else "1" for name in columns}
    for number, measure in enumerate(measures):
        columns[measure.name] = np.array([row.values[number] for row in rows], float)
        units[measure.name] = unit_of(measure.column)
    for number, measure in enumerate(measures if study.repeat else ()):
        columns[f"{measure.name}{BAR}"] = _bars(study, rows, number)
        units[f"{measure.name}{BAR}"] = units[measure.name]
    goals = {table.name: str(table.goal) for table in measures if table.goal is not None}
    failed = {row.member: row.ended.message for row in rows if not row.ended.is_complete}
    return StudyResult(folder, columns, units, goals, failed)


def _column(values: list[Any]) -> Column:
    if all(isinstance(value, int | float) for value in values):
        return np.array(values)
    return np.array([v if isinstance(v, str) else toml_text(v) for v in values], object)


def _bars(study: Study, rows: Sequence[Row], number: int) -> Array:
    """Half widths of the error bars of a measure, the sum of those of all repeated keys; nan in
    rows of coarser resolutions."""
    values = {(row.sample, *_resolutions(study, row.settings)): row.values[number] for row in rows}
    bars = np.full(len(rows), math.nan)
    for place, row in enumerate(rows):
        if not row.is_finest:
            continue
        total = 0.0
        for table in study.repeat:
            settings = [{**row.settings, table.key: n} for n in table.values]
            series = [values[row.sample, *_resolutions(study, one)] for one in settings]
            sound = all(map(math.isfinite, series))
            total += Refinement.of(table.values, series).uncertainty if sound else math.nan
        bars[place] = total
    return bars


def _resolutions(study: Study, settings: Sample) -> tuple[Any, ...]:
    return tuple(settings[table.key] for table in study.repeat)
