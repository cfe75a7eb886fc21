"""Comparison with analytic and published cases: the reference list, run on this machine."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path

from flowborne.validation.case import Case, GridSeries, Result

__all__ = ["Case", "GridSeries", "Result", "case", "case_ids", "run_cases"]

MODULES = {
    "F1": "fluid_cases",
    "F2": "cavity",
    "F4": "scalar_cases",
    "F5": "hydrostatics",
    "F6": "fluid_cases",
    "F7": "fluid_cases",
    "B1": "fixed_bodies",
    "B2": "fixed_bodies",
    "B5": "fixed_bodies",
    "B7": "fixed_sphere",
    "I1": "added_mass",
    "I2": "added_mass",
    "I4": "inviscid",
    "I6": "inviscid",
    "I7": "inviscid",
    "I8": "inviscid",
    "I9": "inviscid",
    "V2": "settling",
    "V8": "viscous",
    "D1": "flesh",
    "D2": "flag_in_channel",
    "D3": "flag_in_channel",
    "D4": "flesh",
    "D5": "flesh",
    "A1": "articulated",
    "A2": "articulated",
    "A3": "articulated",
    "A4": "articulated",
    "K1": "controller",
    "K2": "controller",
    "K3": "controller",
    "K4": "controller",
    "K5": "controller_in_flow",
    "K6": "controller_in_flow",
    "K7": "gradients",
    "K8": "human",
    "K9": "human",
    "K10": "human_wind",
    "K11": "swimmer",
    "S5": "swimmers",
    "R1": "rexeel",
}
"""Case -> module that holds it, in the order of the list; a module is imported when it is run."""


def case_ids() -> Sequence[str]:
    """Every case, in the order of the list."""
    return tuple(MODULES)


def case(name: str) -> Case:
    """The case with this id. Raises KeyError when there is none."""
    module = import_module(f"flowborne.validation.{MODULES[name]}")
    found: dict[str, Case] = {c.id: c for c in module.CASES}
    return found[name]


def run_cases(
    ids: Sequence[str] | None,
    quick: bool,
    on_result: Callable[[Result], None] | None = None,
    report: Path | None = None,
) -> list[Result]:
    """Run cases one after the other, each on all of the machine's cores, and BLAS on one: its
    solves are small.

    ids        which; every one when None
    quick      coarser grids and shorter runs
    on_result  called with every result as its case ends
    report     folder of the report that each case is put into as it ends
    raises     ValueError when that folder holds something else, OSError when it cannot be written
    """
    from threadpoolctl import threadpool_limits

    from flowborne.machine import kernel_threads
    from flowborne.validation.report import add_to_report

    results = []
    for name in case_ids() if ids is None else ids:
        wanted = case(name)
        with kernel_threads(), threadpool_limits(limits=1, user_api="blas"):
            found = wanted.run(quick)
        for result in found:
            if on_result is not None:
                on_result(result)
        if report is not None:
            add_to_report(report, found, quick, case_ids())
        results += found
    return results
