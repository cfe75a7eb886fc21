"""The pressure equation: a weighted cell Laplacian and a term of low rank.

    ( K + J A^-1 J^T ) p = rhs        K     weighted cell Laplacian (see `kernels.levels`)
                                      J     rows in some of the cells
                                      A^-1  the response between their columns (see `mobility`)

Equation (9) of the paper with all other unknowns eliminated: symmetric positive definite but for
its null vectors (see `deflation`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne.kernels.arrays import Array, DenseTerm, Faces, Indices, Integers, Rows
from flowborne.kernels.conjugate_gradients import Matrix, Preconditioner, solve
from flowborne.kernels.levels import at_level
from flowborne.kernels.regions import region_loads
from flowborne.kernels.sparse_rows import padded_rows
from flowborne.kernels.vectors import load_cells
from flowborne.solvers.deflation import compliant_modes, mode_amounts, mode_fields, null_basis
from flowborne.solvers.hierarchy import borrow, prepare
from flowborne.solvers.mobility import Mobility, dense_mobility


@dataclass(frozen=True)
class LowRankTerm:
    """J A^-1 J^T: rows of J in some of the cells, and A^-1.

    rows      of J; a cell may have several
    mobility  A^-1
    """

    rows: Rows
    mobility: Mobility


NO_TERM = LowRankTerm(
    (np.zeros(0, np.int64), np.zeros(1, np.int64), np.zeros(0, np.int64), np.zeros(0)),
    dense_mobility(np.zeros((0, 0))),
)
"""K alone."""

NO_DENSE_TERM: DenseTerm = np.zeros(0, np.int64), np.zeros((0, 0)), np.zeros(0)


@dataclass(frozen=True)
class PressureSolution:
    """What a solve gave.

    pressure    (nx, ny, nz); 0 in cells without an open face, and with no part along null vectors
    iterations  of conjugate gradients
    residual    |rhs - A p| / |rhs| over the active cells, computed from p; rhs without its part
                along the null vectors, which no pressure can balance
    converged   whether the residual asked for was reached
    """

    pressure: Array
    iterations: int
    residual: float
    converged: bool


NO_VECTORS = np.zeros((0, 0))
NO_REACTION = np.zeros((0, 0, 0))
NO_FIELDS = np.zeros((0, 0, 0, 0), np.float32)


class PressureSystem:
    """The matrix for one geometry: build once, solve for any right-hand side and term.

    weights   face weights (nx+1, ny, nz), (nx, ny+1, nz), (nx, ny, nz+1), at least 0. On the outer
              faces of an axis that is not periodic a weight above 0 is an open side, p = 0 on it,
              at the distance that the weight was made with; a periodic axis has the same weights on
              its first and last face. A cell is active when one of its weights is above 0.
    periodic  of each axis
    beyond    a term between active cells that belongs to K, but not to its preconditioner; their
              sum is positive definite
    reaction  (nx, ny, nz), at least 0: D with K + D closer than K to the matrix that is solved; for
              the preconditioner alone
    raises    ValueError for one cell along x or y in 3D, which the ghost layout has no room for
    """

    def __init__(
        self,
        weights: Faces,
        periodic: tuple[bool, bool, bool] = (False, False, False),
        reaction: Array = NO_REACTION,
        beyond: DenseTerm = NO_DENSE_TERM,
    ) -> None:
        nx, ny, nz = weights[1].shape[0], weights[0].shape[1], weights[0].shape[2]
        self.shape = (nx, ny, nz)
        if nz > 1 and nx == 1:
            raise ValueError(
                f"a grid of {nx} x {ny} x {nz} cells is one cell thick along x. "
                "Turn it so that its thin axis is z."
            )
        self.slab = nz == 1
        inner = (1, nx, ny) if self.slab else self.shape
        wraps = (False, periodic[0], periodic[1]) if self.slab else periodic
        self.periodic = np.array(wraps, np.uint8)
        x, y, z = (np.ascontiguousarray(w, np.float64) for w in weights)
        faces = (x, y, z)
        if self.slab:
            faces = (np.zeros((1, 1, 1)), x.reshape(1, nx + 1, ny), y.reshape(1, nx, ny + 1))
        self.beyond = padded_cells(beyond[0], inner), *beyond[1:]
        self._prepared: tuple[LowRankTerm, Matrix, Preconditioner] | None = None
        self.buffers = borrow((inner, wraps), self)
        b = self.buffers
        self.hierarchy = b.hierarchy(self.periodic)
        self.regions, self.scale, self.finest = prepare(
            self.hierarchy, faces, reaction, b.finest, b.label, b.parent, b.count
        )

    def solve(
        self,
        rhs: Array,
        guess: Array | None = None,
        term: LowRankTerm = NO_TERM,
        tolerance: float = 1e-9,
        absolute: float = 0.0,
    ) -> PressureSolution:
        """Solve to  |rhs - A p| <= max(tolerance |rhs|, absolute).

        rhs, guess  (nx, ny, nz); values in cells without an open face are ignored
        """
        if not term.mobility.yields:
            term = NO_TERM
        b = self.buffers
        inner = b.label.shape
        cells = (inner[0] - 2 if inner[0] > 1 else 1, inner[1] - 2, inner[2] - 2)
        diagonal = b.finest[3]
        x, right = b.vectors[:2]
        if guess is None:
            x[:] = 0.0
        else:
            load_cells(x, np.ascontiguousarray(guess, np.float64).reshape(cells), diagonal)
        load_cells(right, np.ascontiguousarray(rhs, np.float64).reshape(cells), diagonal)
        if self._prepared is None or self._prepared[0] is not term:
            self._prepared = term, *self._with_term(term)
        matrix, cycle = self._prepared[1:]
        iterations, residual, converged = solve(matrix, cycle, b.vectors, tolerance, absolute)
        start = (1 if inner[0] > 1 else 0, 1, 1)
        inside = tuple(slice(s, s + n) for s, n in zip(start, cells, strict=True))
        pressure = x[inside].copy().reshape(self.shape)
        return PressureSolution(pressure, int(iterations), float(residual), bool(converged))

    def closed_regions(self) -> Indices:
        """(nx, ny, nz) number of the region without an open side of each cell, -1 in all others."""
        label = self.buffers.label
        inner = label[(slice(None) if self.slab else slice(1, -1), slice(1, -1), slice(1, -1))]
        return inner.reshape(self.shape)

    def _with_term(self, term: LowRankTerm) -> tuple[Matrix, Preconditioner]:
        """The matrix with the term, the same for every right-hand side, and what deflates it."""
        b, mobility = self.buffers, term.mobility
        diagonal = b.finest[3]
        rows = padded_rows(term.rows, diagonal)
        null, amounts, fields = NO_VECTORS, NO_VECTORS, NO_FIELDS
        if self.regions:
            loads = region_loads(b.label, self.regions, mobility.size, rows)
            null = null_basis(b.count[: self.regions], loads, mobility)
        inverse = at_level(b.inverse, b.table, 0)
        held = null.shape[1] < self.regions
        modes = compliant_modes(mobility, rows, inverse, self.scale, max(self.shape), held)
        if modes.size:
            fields, gram = mode_fields(self.hierarchy, b.cycle, rows, modes)
            amounts = mode_amounts(modes, gram)
        matrix = Matrix(self.finest, rows, mobility.arrays, self.beyond, b.label, null)
        return matrix, Preconditioner(self.hierarchy, b.cycle, fields, amounts)


def padded_cells(cells: Integers, shape: tuple[int, int, int]) -> Integers:
    """Flat indices of cells of a grid of this shape in padded arrays."""
    i, j, k = np.unravel_index(cells, shape)
    deep = int(shape[0] > 1)
    return np.ravel_multi_index(
        (i + deep, j + 1, k + 1), (shape[0] + 2 * deep, shape[1] + 2, shape[2] + 2)
    )
