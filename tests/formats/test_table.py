"""The history as CSV and Parquet, read back by pandas and pyarrow."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import flowborne as fb
from flowborne.formats.table import unit_of

pandas = pytest.importorskip("pandas")
parquet = pytest.importorskip("pyarrow.parquet")


@pytest.mark.parametrize("name", ["chain", "fish", "walk"])
def test_numbers_are_those_of_the_history(
    name: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    run = fb.open_run(request.getfixturevalue(name))
    for ending, read in ((".csv", pandas.read_csv), (".parquet", pandas.read_parquet)):
        fb.export(run.folder, tmp_path / f"history{ending}")
        table = read(tmp_path / f"history{ending}")
        assert tuple(table.columns) == tuple(run.history)
        for column, values in run.history.items():
            assert_array_equal(table[column], values)
        assert table["frame"].dtype == np.int64


def test_parquet_has_the_units(chain: Path, tmp_path: Path) -> None:
    fb.export(chain, tmp_path / "history.parquet")
    schema = parquet.read_schema(tmp_path / "history.parquet")
    units = {field.name: field.metadata[b"unit"].decode() for field in schema}
    assert units["time_s"] == "s"
    assert units["angle_hinge1_rad"] == "rad"
    assert units["block1_x_m"] == "m"
    assert units["block1_qw"] == units["contacts"] == "1"
    assert units["momentum_solid_x_Ns"] == "N s"
    assert units["fastest_m/s"] == "m/s"
    assert units["effort"] == "N m s"
    assert units["objective"] == ""
    assert schema.metadata[b"scene"] == b"ns-chain-2"
    assert float(schema.metadata[b"frames_per_second"]) == 24.0
    assert schema.metadata[b"slab"] == b"1"


def test_every_column_that_names_a_unit_has_it(chain: Path, fish: Path, walk: Path) -> None:
    bare = {
        column.rpartition("_")[2]
        for folder in (chain, fish, walk)
        for column in fb.open_run(folder).history
        if unit_of(column) == "1"
    }
    assert bare <= {
        *("frame", "detF", "out", "error", "iterations", "sweeps", "residual", "contacts"),
        *("qw", "qx", "qy", "qz"),
    }
