"""Compiling kernels in a second process.

Half of what a first run compiles is the pressure solver and the transport of momentum. Neither
needs anything of the rest, so another process compiles both for the cache on disc, in the order in
which a step comes to them: meanwhile this process compiles what the step begins with.
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
def compile_beside() -> None:
    """Have solver and transport compiled by another process, unless the solver is in the cache or
    this machine has one core. At most once in a process; it need not be waited for."""
    from flowborne.kernels.conjugate_gradients import solve
    from flowborne.kernels.jit import cores

    index = Path(solve.serial.stats.cache_path)
    if cores() == 1 or any(index.glob("conjugate_gradients.solve-*.nbi")):
        return
    quiet = subprocess.DEVNULL
    command = [sys.executable, "-m", "flowborne.coupling.compiling"]
    subprocess.Popen(command, stdin=quiet, stdout=quiet, stderr=quiet)


def compile_iteration() -> None:
    """Solve for the pressure of nothing: the types of arrays are all that compiling needs."""
    from flowborne.kernels.conjugate_gradients import solve
    from flowborne.kernels.levels import even_at
    from flowborne.solvers.hierarchy import Buffers
    from flowborne.solvers.pressure import NO_DENSE_TERM, NO_FIELDS, NO_TERM, NO_VECTORS

    b, term = Buffers((1, SMALL, SMALL)), NO_TERM
    hierarchy, low_rank = b.hierarchy(np.zeros(3, np.uint8)), (term.rows, term.mobility.arrays)
    finest = (*b.finest, even_at(b.even, b.table, 0), 0)
    matrix = hierarchy, b.cycle, finest, b.vectors, *low_rank, NO_DENSE_TERM
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
        (
            np.array([27, 28]),
            np.array([0, 6, 12]),
            np.tile(np.arange(6), 2),
            np.append(np.ones(6), -np.ones(6)),
        ),
        dense_mobility(100.0 * np.eye(6)),
    )
    rhs = np.zeros((SMALL, SMALL, 1))
    rhs[2, 2], rhs[5, 5] = 1.0, -1.0
    PressureSystem(weights).solve(rhs, term=term)


def carry_small_slab() -> None:
    """Carry a velocity through a small slab at rest, which takes every kernel."""
    from flowborne.fluid.boundary import Boundaries
    from flowborne.fluid.control_volumes import control_volumes
    from flowborne.fluid.grid import Grid, faces_of
    from flowborne.fluid.transport import NO_INLETS, Transport, carry_component

    grid, sides = Grid.slab(SMALL, SMALL, 1.0, (0.0, 0.0)), Boundaries()
    cells, still = np.ones(grid.shape), grid.zeros_faces()
    opened = faces_of([np.ones(grid.face_shape(axis)) for axis in range(3)])
    volumes = control_volumes(cells, opened, grid, sides)
    transport = Transport(still, volumes, volumes, 1.0, 0.0)
    carry_component(still[0], np.zeros(still[0].shape), 0, transport, NO_INLETS, grid, sides)


if __name__ == "__main__":
    compile_iteration()
    solve_small_slab()
    carry_small_slab()
