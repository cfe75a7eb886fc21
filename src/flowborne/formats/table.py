"""The history of a run as a table: CSV, and Parquet with the unit of each column."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flowborne.base.atomic import replaced_whole, write_text
from flowborne.base.extras import optional
from flowborne.runs.exporters import provided
from flowborne.runs.history import unit_of
from flowborne.runs.open_run import StoredRun

COUNTS = ("frame", "solver_iterations", "sweeps", "contacts", "flesh_inside_out")
"""Columns of integers."""


def _columns(run: StoredRun) -> dict[str, NDArray[np.generic]]:
    """The history, with counts as integers."""
    return {
        name: values.astype(np.int64) if name in COUNTS and np.isfinite(values).all() else values
        for name, values in run.history.items()
    }


@provided(".csv")
@dataclass(frozen=True)
class ExporterCsv:
    """A row per frame, with the columns of history.csv; names end in units, numbers are exact."""

    def write(self, run: StoredRun, path: Path) -> None:
        columns = _columns(run)
        text = io.StringIO()
        table = csv.writer(text, lineterminator="\n")
        table.writerow(columns)
        table.writerows(zip(*(values.tolist() for values in columns.values()), strict=True))
        write_text(path, text.getvalue())


@provided(".parquet")
@dataclass(frozen=True)
class ExporterParquet:
    """The same columns, each with its unit in the metadata of its field.

    Metadata of the table: scene, frames_per_second, and slab, which is 1 if forces, torques,
    impulses, work and volumes are per metre of depth.
    """

    def write(self, run: StoredRun, path: Path) -> None:
        arrow = optional("pyarrow", "pyarrow", "parquet", "'.parquet' files")
        parquet = optional("pyarrow.parquet", "pyarrow", "parquet", "'.parquet' files")
        columns = _columns(run)
        metadata = {
            "scene": run.name,
            "frames_per_second": repr(run.frames_per_second),
            "slab": str(int(run.is_slab)),
        }
        fields = [
            arrow.field(name, arrow.from_numpy_dtype(values.dtype), True, {"unit": unit_of(name)})
            for name, values in columns.items()
        ]
        schema = arrow.schema(fields, metadata)
        with replaced_whole(path) as new:
            parquet.write_table(arrow.table(columns, schema=schema), new)
