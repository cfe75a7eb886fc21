"""The pressure solve: against an algebraic multigrid, and from grid to grid."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from flowborne import Array, Faces
from flowborne.machine import cores, kernel_threads
from flowborne.worlds import PressureSolution, PressureSystem
from flowborne_validation.bench.timing import Result, at_least, at_most, timed

TOLERANCE = 1e-5
"""True residual of both solvers, over that of zero pressure."""

THREADS = 2
FASTER = 30.0
"""Least ratio of pyamg's time to ours."""

COMPARED = (64, 128)
REFINED = (32, 64, 128, 256)
GROWTH = 1.5
"""Iterations on the finest of REFINED over those on the coarsest, at most."""


def pressure() -> Iterator[Result]:
    """Ratios of time to pyamg's, then iteration counts."""
    for cells in COMPARED:
        yield compare(cells)
    yield refine()


def compare(cells: int) -> Result:
    """Set-up and solve of ours against pyamg's Ruge-Stuben with conjugate gradients."""
    weights, rhs = sphere_in_stream(cells)
    solved(weights, rhs)
    ours, seconds = timed(lambda: solved(weights, rhs), repeats=15)
    matrix, active = assemble(weights)
    b = rhs.ravel()[active]
    solution, theirs = timed(lambda: algebraic(matrix, b), repeats=2)
    mine = residual(matrix, b, ours.pressure.ravel()[active])
    other = residual(matrix, b, solution)
    title = f"{cells}^3 with cut cells, {min(THREADS, cores())} threads: pyamg's time over ours"
    lines = [
        f"flowborne {seconds:.4f} s, {ours.iterations} iterations, true residual {mine:.1e}",
        f"pyamg     {theirs:.4f} s, true residual {other:.1e}",
    ]
    found = at_least("pressure", title, theirs / seconds, FASTER, lines)
    return found if max(mine, other) <= TOLERANCE else replace(found, verdict="fail")


def refine() -> Result:
    """Iterations as the grid is refined."""
    lines, counts = [], []
    for cells in REFINED:
        weights, rhs = sphere_in_stream(cells)
        found, seconds = timed(lambda w=weights, b=rhs: solved(w, b))  # type: ignore[misc]
        counts.append(found.iterations)
        lines.append(
            f"{cells}^3: {found.iterations} iterations, {seconds:.3f} s, "
            f"true residual {found.residual:.1e}"
        )
    title = f"iterations at {REFINED[-1]}^3 over those at {REFINED[0]}^3"
    return at_most("pressure", title, counts[-1] / counts[0], GROWTH, lines)


def sphere_in_stream(cells: int) -> tuple[Faces, Array]:
    """Weights and right-hand side of a uniform, slightly rough stream that meets a sphere.

    Cube of edge 1 with `cells` cells along each axis, open at the upper x side, closed elsewhere.
    """
    h = 1.0 / cells
    rng = np.random.default_rng(0)
    weights, net = [], np.zeros((cells, cells, cells))
    for axis in range(3):
        x, y, z = (
            h * (np.arange(cells + (n == axis)) + 0.5 * (n != axis)) - centre
            for n, centre in enumerate((0.45, 0.5, 0.52))
        )
        distance = np.sqrt(x[:, None, None] ** 2 + y[:, None] ** 2 + z**2) - 0.2
        w = h * np.clip(distance / h + 0.5, 0.0, 1.0)
        ends = np.moveaxis(w, axis, 0)
        ends[0] = ends[-1] = 0.0
        if axis == 0:
            ends[-1] = 2.0 * h
        weights.append(w)
        net += np.diff(w * ((axis == 0) + 0.1 * rng.standard_normal(w.shape)), axis=axis)
    return (weights[0], weights[1], weights[2]), -net


def solved(weights: Faces, rhs: Array) -> PressureSolution:
    """Set-up and solve on THREADS threads."""
    with kernel_threads(THREADS):
        return PressureSystem(weights).solve(rhs, tolerance=TOLERANCE)


def assemble(weights: Faces) -> tuple[Any, NDArray[np.intp]]:
    """Sparse matrix over the active cells, and their numbers."""
    shape = weights[1].shape[0], weights[0].shape[1], weights[0].shape[2]
    index = np.arange(np.prod(shape)).reshape(shape)
    diagonal = np.zeros(shape)
    below, above, between = [], [], []
    for axis in range(3):
        w, c = np.moveaxis(weights[axis], axis, 0), np.moveaxis(index, axis, 0)
        np.moveaxis(diagonal, axis, 0)[...] += w[:-1] + w[1:]
        touching = w[1:-1] > 0.0
        below.append(c[:-1][touching])
        above.append(c[1:][touching])
        between.append(-w[1:-1][touching])
    i, j, v = (np.concatenate(parts) for parts in (below, above, between))
    upper = sparse.coo_matrix((v, (i, j)), (index.size, index.size))
    matrix = (upper + upper.T + sparse.diags(diagonal.ravel())).tocsr()
    active = np.flatnonzero(diagonal)
    return matrix[active][:, active], active


def algebraic(matrix: Any, b: Array) -> Array:
    """pyamg's set-up and solve, to a true residual of TOLERANCE.

    raises  ModuleNotFoundError without pyamg
    """
    try:
        from pyamg import ruge_stuben_solver
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            "the bench 'pressure' compares with pyamg, which is not installed; "
            'install it with: pip install "flowborne[bench]"'
        ) from error
    solver = ruge_stuben_solver(matrix)
    asked = TOLERANCE
    x: Array = solver.solve(b, tol=asked, accel="cg")
    while residual(matrix, b, x) > TOLERANCE:
        asked *= 0.5
        x = solver.solve(b, x0=x, tol=asked, accel="cg")
    return x


def residual(matrix: Any, b: Array, x: Array) -> float:
    """|b - A x| / |b|."""
    return float(np.linalg.norm(b - matrix @ x) / np.linalg.norm(b))
