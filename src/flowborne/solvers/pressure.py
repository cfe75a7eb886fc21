"""The pressure equation: a weighted cell Laplacian and a term of low rank.

    ( K + J A^-1 J^T ) p = rhs        K     weighted cell Laplacian (see `kernels.levels`)
                                      J     rows in some of the cells
                                      A^-1  the response between their columns (see `mobility`)

Equation (9) of the paper with all other unknowns eliminated: symmetric positive definite but for
its null vectors.

A V-cycle V on K alone is a poor guide to this matrix where the term of low rank outweighs K. With
A^-1 = R R^T and B = J R,

    (V^-1 + B B^T)^-1  =  V - Y (1 + B^T Y)^-1 Y^T        Y = V B

takes in every mode, a column of R, at the price of a V-cycle each (Woodbury's identity). Modes that
weigh little against K are left out.

In a region without an open side K knows the unknown only up to a constant. A sum of such constants,
c_r in region r, is a null vector when A^-1 is 0 on the load  J^T (sum of c_r 1_r).

Method: docs/method/coupled-solve.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne.kernels.arrays import (
    Array,
    DenseTerm,
    Faces,
    Hierarchy,
    Indices,
    Integers,
    Labels,
    Real,
    Rows,
)
from flowborne.kernels.conjugate_gradients import Matrix, Preconditioner, solve
from flowborne.kernels.levels import at_level
from flowborne.kernels.regions import NULL, region_loads
from flowborne.kernels.sparse_rows import add_rows, padded_rows, row_gram, row_gram_along, sum_rows
from flowborne.kernels.v_cycle import v_cycle
from flowborne.kernels.vectors import load_cells
from flowborne.solvers.hierarchy import borrow
from flowborne.solvers.mobility import Mobility, dense_mobility

MOST_MODES = 32
"""Modes that are taken in, the most compliant first; more would cost more than they save."""

LEAST_WEIGHT = 0.5
"""A mode is left out when its term cannot weigh more than this against K."""

LEAST_WEIGHT_FACTORED = 100.0
"""The same where the V-cycle knows the diagonal of the term, as it does for a factorised A^-1:
iterations that a mode of less would save cost less than it does."""


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
        self.inner = inner = (1, nx, ny) if self.slab else self.shape
        self.inside = slice(None) if self.slab else slice(1, -1), slice(1, -1), slice(1, -1)
        wraps = (False, periodic[0], periodic[1]) if self.slab else periodic
        x, y, z = (np.ascontiguousarray(w, np.float64) for w in weights)
        faces = (x, y, z)
        if self.slab:
            faces = (np.zeros((1, 1, 1)), x.reshape(1, nx + 1, ny), y.reshape(1, nx, ny + 1))
        self.beyond = padded_cells(beyond[0], inner), *beyond[1:]
        self._prepared: tuple[LowRankTerm, Matrix, Preconditioner] | None = None
        self._applied: Array | None = None  # the pressure of the last solve, if its A p is known
        self.buffers = borrow(inner, wraps, self)
        self.regions, self.scale, self.finest = self.buffers.prepare(faces, reaction)

    def solve(
        self,
        rhs: Array,
        guess: Array | None = None,
        term: LowRankTerm = NO_TERM,
        tolerance: float = 1e-9,
        absolute: float = 0.0,
    ) -> PressureSolution:
        """Solve to  |rhs - A p| <= max(tolerance |rhs|, absolute).

        rhs, guess  (nx, ny, nz); values in cells without an open face are ignored. A guess that is
                    the last solution itself goes on from where that solve ended
        """
        if not term.mobility.yields:
            term = NO_TERM
        b, cells = self.buffers, self.inner
        diagonal = b.finest[3]
        x, right = b.vectors[:2]
        same = self._prepared is not None and self._prepared[0] is term
        applied = same and guess is not None and guess is self._applied
        if guess is None:
            x[:] = 0.0
        elif not applied:
            load_cells(x, np.ascontiguousarray(guess, np.float64).reshape(cells), diagonal)
        load_cells(right, np.ascontiguousarray(rhs, np.float64).reshape(cells), diagonal)
        if self._prepared is None or not same:
            self._prepared = term, *self._with_term(term)
        matrix, cycle = self._prepared[1:]
        guessed = guess is not None and bool(guess.any())
        iterations, residual, converged = solve(
            matrix, cycle, b.vectors, tolerance, absolute, guessed, applied
        )
        pressure = x[self.inside].copy().reshape(self.shape)
        self._applied = pressure if iterations > 0 or pressure.any() else None
        return PressureSolution(pressure, int(iterations), float(residual), bool(converged))

    def closed_regions(self) -> Indices:
        """(nx, ny, nz) number of the region without an open side of each cell, -1 in all others."""
        return self.buffers.label[self.inside].reshape(self.shape)

    def _with_term(self, term: LowRankTerm) -> tuple[Matrix, Preconditioner]:
        """The matrix with the term, the same for every right-hand side, and what deflates it."""
        b, mobility = self.buffers, term.mobility
        diagonal = b.finest[3]
        rows = padded_rows(term.rows, diagonal) if term.rows[0].size else term.rows
        null, amounts, fields = NO_VECTORS, NO_VECTORS, NO_FIELDS
        if self.regions:
            loads = region_loads(b.label, self.regions, mobility.size, rows)
            null = null_basis(b.count[: self.regions], loads, mobility)
        inverse = at_level(b.inverse, b.table, 0)
        held = null.shape[1] < self.regions
        modes = compliant_modes(mobility, rows, inverse, self.scale, max(self.shape), held)
        if modes.size:
            fields, amounts = mode_fields(b.hierarchy, b.cycle, rows, modes)
        matrix = Matrix(self.finest, rows, mobility.arrays, self.beyond, b.label, null)
        return matrix, Preconditioner(b.hierarchy, b.cycle, fields, amounts)


def padded_cells(cells: Integers, shape: tuple[int, int, int]) -> Integers:
    """Flat indices of cells of a grid of this shape in padded arrays."""
    if not cells.size:
        return cells
    i, j, k = np.unravel_index(cells, shape)
    deep = int(shape[0] > 1)
    return np.ravel_multi_index(
        (i + deep, j + 1, k + 1), (shape[0] + 2 * deep, shape[1] + 2, shape[2] + 2)
    )


def compliant_modes(
    mobility: Mobility, rows: Rows, inverse: Real, scale: float, across: int, held: bool
) -> Array:
    """(k, m) R with R R^T equal to scale x A^-1 but for modes that weigh little against K.

    mobility  A^-1
    inverse   padded: of the diagonal that the V-cycle is made for; what a mode weighs against it is
              `row_gram`
    scale     of the hierarchy's weights
    across    most cells along an axis: how much more a mode may weigh against K than against its
              diagonal
    held      whether the term alone holds the level of some region, which no V-cycle knows
    """
    if mobility.size == 0:
        return np.zeros((0, 0))
    root = np.sqrt(scale) * mobility.compliant
    if mobility.is_dense:
        weight = root.T @ row_gram(rows, inverse, mobility.size) @ root
    else:
        weight = row_gram_along(rows, inverse, root)
    ratio, turned = np.linalg.eigh(weight)
    least = LEAST_WEIGHT if mobility.is_dense or held else LEAST_WEIGHT_FACTORED
    chosen = np.flatnonzero(ratio * across > least)[-MOST_MODES:]
    return np.ascontiguousarray(root @ turned[:, chosen])


def mode_fields(
    hierarchy: Hierarchy, cycle: tuple[Real, Real, Real], rows: Rows, modes: Array
) -> tuple[Real, Array]:
    """Y (m, padded shape) with ghosts 0, and (m, k) (1 + B^T Y)^-1 R^T, how much of each field to
    take off for a load J^T V r, for modes (k, m)."""
    x, b, _ = cycle
    z, source = at_level(x, hierarchy[0], 0), at_level(b, hierarchy[0], 0)
    inside = tuple(slice(1, -1) if n > 1 else slice(None) for n in z.shape)
    size, count = modes.shape
    fields, matrix = np.zeros((count, *z.shape), z.dtype), np.eye(count)
    for n in range(count):
        source[:] = 0.0
        add_rows(source, rows, np.ascontiguousarray(modes[:, n]))
        v_cycle(hierarchy, *cycle)
        fields[n][inside] = z[inside]
        matrix[:, n] += sum_rows(z, rows, size) @ modes
    scale = 1.0 / np.sqrt(np.diag(matrix))
    inverse: Array = scale[:, None] * np.linalg.inv(scale[:, None] * matrix * scale) * scale
    return fields, inverse @ modes.T


def null_basis(count: Labels, loads: Array, mobility: Mobility) -> Array:
    """(regions, q) constants per region of an orthonormal basis of the operator's null space.

    count     (regions,) cells of each region without an open side
    loads     (regions, k) J^T 1_r of each region
    mobility  A^-1

    A region whose load has no response is a null vector of its own. Among the others, combinations
    c with  c^T F c = 0  for F_rs = (J^T 1_r)^T A^-1 (J^T 1_s) are: of two regions whose loads are
    opposite, only the constant that both share.
    """
    scale = 1.0 / np.sqrt(count)
    answers = mobility.times(loads)
    strength = np.einsum("rk,rk->r", answers, loads) * scale**2
    largest = mobility.largest() * np.square(loads * scale[:, None]).max(initial=0)
    held = strength > NULL * largest
    free = np.flatnonzero(~held)
    basis = np.zeros((count.size, free.size))
    basis[free, np.arange(free.size)] = scale[free]
    if not held.any():
        return basis
    scaled = loads[held] * scale[held, None]
    energy, vectors = np.linalg.eigh(mobility.times(scaled) @ scaled.T)
    null = vectors[:, energy < NULL * energy[-1]]
    joint = np.zeros((count.size, null.shape[1]))
    joint[held] = scale[held, None] * null
    return np.concatenate([basis, joint], axis=1)
