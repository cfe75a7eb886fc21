"""How fast it is: each bench is a generator of results, a function of its name in a module here.

Speeds are ratios within one run wherever there is something to compare with, so that they mean the
same on every machine.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flowborne_validation.bench.timing import Result

MODULES = {
    "pressure": "pressure",
    "workers": "speed",
    "chain": "speed",
    "realtime": "speed",
    "human": "speed",
    "parts": "frame_costs",
    "size": "frame_costs",
    "memory": "frame_costs",
    "threads": "speed",
    "steps": "steps",
    "first-run": "startup",
    "start": "startup",
}
"""Bench -> the module here that has it, in the order in which they run."""


def bench_names() -> Sequence[str]:
    """Every bench, in order."""
    return list(MODULES)


def run_benches(
    names: Sequence[str] | None, on_result: Callable[[Result], None] | None = None
) -> list[Result]:
    """Run benches one after the other.

    names      which; every one when None
    on_result  called with every result as it comes
    raises     ModuleNotFoundError when a bench needs a package of the `bench` extra that is missing
    """
    results = []
    for name in bench_names() if names is None else names:
        start = time.perf_counter()
        module = import_module(f"flowborne_validation.bench.{MODULES[name]}")
        found: Iterator[Result] = getattr(module, name.replace("-", "_"))()
        for result in found:
            now = time.perf_counter()
            results.append(replace(result, seconds=now - start))
            start = now
            if on_result is not None:
                on_result(results[-1])
    return results
