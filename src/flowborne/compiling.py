"""Compiling the kernels of the pressure solver in a second process.

A first run compiles for a minute on one core. The pressure solver is half of that and needs nothing
of the rest, so another process compiles it for the cache on disc while this one begins with the
grid and what flows there; when the solver's turn comes, it is loaded.
"""

from __future__ import annotations

import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np


@cache
def compile_solver_beside() -> None:
    """Have the pressure solver compiled by another process, unless it is in the cache or this
    machine has one core. At most once in a process; it need not be waited for."""
    from flowborne.kernels.conjugate_gradients import solve
    from flowborne.kernels.jit import cores

    index = Path(solve.serial.stats.cache_path)
    if cores() == 1 or any(index.glob("conjugate_gradients.solve-*.nbi")):
        return
    quiet = subprocess.DEVNULL
    command = [sys.executable, "-m", "flowborne.compiling"]
    subprocess.Popen(command, stdin=quiet, stdout=quiet, stderr=quiet)


def compile_solver() -> None:
    """Solve for the pressure around a light body in a small slab: all kernels of that are then in
    the cache."""
    from flowborne.solvers.mobility import dense_mobility
    from flowborne.solvers.pressure import LowRankTerm, PressureSystem

    count = 8
    weights = (
        np.ones((count + 1, count, 1)),
        np.ones((count, count + 1, 1)),
        np.zeros((count, count, 2)),
    )
    for axis in range(2):
        for end in (0, -1):
            np.moveaxis(weights[axis], axis, 0)[end] = 0.0
    rows = np.array([27, 28])
    term = LowRankTerm(
        rows,
        np.array([0, 6, 12]),
        np.tile(np.arange(6), 2),
        np.append(np.ones(6), -np.ones(6)),
        dense_mobility(100.0 * np.eye(6)),
    )
    rhs = np.zeros((count, count, 1))
    rhs[2, 2], rhs[5, 5] = 1.0, -1.0
    PressureSystem(weights).solve(rhs, term=term)


if __name__ == "__main__":
    compile_solver()
