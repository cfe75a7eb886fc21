"""The frame of the benches; their figures are for the command, not for tests."""

import sys
from importlib import import_module

import numpy as np
import pytest

from flowborne_validation import bench
from flowborne_validation.bench import pressure
from flowborne_validation.bench.timing import Result, timed, verdict


@pytest.mark.parametrize("name", bench.bench_names())
def test_every_bench_can_be_measured(name):
    module = import_module(f"flowborne_validation.bench.{bench.MODULES[name]}")
    assert callable(getattr(module, name.replace("-", "_")))


def test_results_are_handed_on_as_they_come(monkeypatch):
    rows = [
        Result("pressure", "one", 2.0, "at least 1", "pass"),
        Result("pressure", "two", 0, "", "info"),
    ]
    monkeypatch.setattr(pressure, "pressure", lambda: iter(rows))
    seen = []
    found = bench.run_benches(["pressure"], seen.append)
    assert found == seen
    assert [r.title for r in found] == ["one", "two"]
    assert all(r.seconds >= 0.0 for r in found)
    assert found[0].as_dict()["target"] == "at least 1"


def test_timing_takes_the_quickest_of_all_runs():
    calls = []
    found, seconds = timed(lambda: calls.append(0) or 7, repeats=3)
    assert found == 7
    assert len(calls) == 3
    assert seconds >= 0.0
    assert (verdict(True), verdict(False)) == ("pass", "fail")


def test_both_solvers_of_the_pressure_bench_solve_the_same_system():
    weights, rhs = pressure.sphere_in_stream(12)
    matrix, active = pressure.assemble(weights)
    found = pressure.PressureSystem(weights).solve(rhs, tolerance=1e-10)
    b = rhs.ravel()[active]
    assert pressure.residual(matrix, b, found.pressure.ravel()[active]) <= 2e-10
    assert 0 < rhs.size - active.size < 0.1 * rhs.size


def test_without_pyamg_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyamg", None)
    matrix, _ = pressure.assemble(pressure.sphere_in_stream(4)[0])
    with pytest.raises(ModuleNotFoundError, match=r"flowborne\[bench\]"):
        pressure.algebraic(matrix, np.ones(matrix.shape[0]))
