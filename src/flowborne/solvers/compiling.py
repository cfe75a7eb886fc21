"""Compiling the kernels of the pressure solver in a second process.

A first run compiles for about 70 s on one core. The pressure solver is more than half of that and
needs nothing of the rest, so another process compiles it for the cache on disc. It begins where a
step comes last, with the iteration: meanwhile this process compiles what the step begins with, and
finds in the cache what the other has done by then.
"""

from __future__ import annotations

import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np

SMALL = 8
"""Cells along both axes of the slab that is solved for."""


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
    command = [sys.executable, "-m", "flowborne.solvers.compiling"]
    subprocess.Popen(command, stdin=quiet, stdout=quiet, stderr=quiet)


def compile_solver() -> None:
    """Have all kernels of the pressure solver in the cache: the iteration first."""
    compile_iteration()
    solve_small_slab()


def compile_iteration() -> None:
    """Solve for the pressure of nothing: the types of arrays are all that compiling needs."""
    from flowborne.kernels.conjugate_gradients import solve
    from flowborne.solvers.hierarchy import Buffers
    from flowborne.solvers.pressure import NO_FIELDS, NO_TERM, NO_VECTORS

    b, term = Buffers((1, SMALL, SMALL)), NO_TERM
    rows = term.cells, term.row_start, term.columns, term.values
    hierarchy, response = b.hierarchy(np.zeros(3, np.uint8)), term.mobility.arrays
    matrix = hierarchy, b.cycle, b.finest, b.vectors, rows, response
    solve(*matrix, b.label, NO_VECTORS, NO_FIELDS, NO_VECTORS, 0.0, 0.0)


def solve_small_slab() -> None:
    """Solve for the pressure around a light body in a small slab, which takes every kernel."""
    from flowborne.solvers.mobility import dense_mobility
    from flowborne.solvers.pressure import LowRankTerm, PressureSystem

    weights = (
        np.ones((SMALL + 1, SMALL, 1)),
        np.ones((SMALL, SMALL + 1, 1)),
        np.zeros((SMALL, SMALL, 2)),
    )
    for axis in range(2):
        for end in (0, -1):
            np.moveaxis(weights[axis], axis, 0)[end] = 0.0
    term = LowRankTerm(
        np.array([27, 28]),
        np.array([0, 6, 12]),
        np.tile(np.arange(6), 2),
        np.append(np.ones(6), -np.ones(6)),
        dense_mobility(100.0 * np.eye(6)),
    )
    rhs = np.zeros((SMALL, SMALL, 1))
    rhs[2, 2], rhs[5, 5] = 1.0, -1.0
    PressureSystem(weights).solve(rhs, term=term)


if __name__ == "__main__":
    compile_solver()
