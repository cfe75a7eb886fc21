"""The pressure equation with bodies in it.

    ( K + G^T M G ) p = rhs        K  weighted cell Laplacian (see `levels`)
                                   G  wrench of a pressure field on every body
                                   M  twist that a unit wrench impulse gives them

Equation (9) of the paper with the bodies' velocities eliminated: symmetric positive definite but
for the pressures that push nothing (see `regions`).
"""

from __future__ import annotations

import weakref
from dataclasses import dataclass

import numpy as np

from flowborne.fluid.body_modes import body_modes, mode_answers, mode_fields
from flowborne.fluid.grid import Array, Faces
from flowborne.fluid.levels import level_table
from flowborne.fluid.regions import null_basis
from flowborne.fluid.response import Response, dense_response
from flowborne.kernels.aggregates import OWN
from flowborne.kernels.arrays import Finest, Hierarchy, Integers, Labels, Marks, Places, Real, Rows
from flowborne.kernels.conjugate_gradients import solve
from flowborne.kernels.levels import LEAN, at_level, coarsen, finest_weights
from flowborne.kernels.regions import label_regions, region_loads
from flowborne.kernels.sparse_rows import padded_rows
from flowborne.kernels.vectors import largest, load_cells, scaled


@dataclass(frozen=True)
class Coupling:
    """How pressure moves the bodies: rows of G^T per cut cell, and M.

    cells      (m,) flat index of the cell of each row; a cell may have several rows
    row_start  (m+1,) where each row's entries begin
    columns    (nnz,) column of M: of a body's wrench, or of a force on flesh
    values     (nnz,) component that unit pressure in the cell exerts, m^2 or m^3
    response   M
    """

    cells: Integers
    row_start: Integers
    columns: Integers
    values: Array
    response: Response


UNCOUPLED = Coupling(
    np.zeros(0, np.int64),
    np.zeros(1, np.int64),
    np.zeros(0, np.int64),
    np.zeros(0),
    dense_response(np.zeros((0, 0))),
)
"""No bodies, or none that the fluid can move."""


@dataclass(frozen=True)
class Coupled:
    """What a coupling adds to the system of one geometry, the same for every right-hand side.

    rows     of G^T in active cells, with padded flat indices
    null     see `regions.null_basis`
    fields   (m, padded shape) and
    answers  (m, k) of the motions in the preconditioner; see `body_modes`
    """

    rows: Rows
    null: Array
    fields: Real
    answers: Array


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


def zeros(shape: tuple[int, int, int]) -> Array:
    return np.zeros(shape)


def packed(size: int) -> Real:
    return np.zeros(size, np.float32)


class Buffers:
    """Arrays of one hierarchy and of one solve, kept for the next system of the same kind."""

    def __init__(self, shape: tuple[int, int, int]) -> None:
        self.table = level_table(shape)
        total = int(self.table[-1, 0])
        n0, n1, n2 = shape
        padded = (n0 + 2 if n0 > 1 else 1, n1 + 2, n2 + 2)
        self.finest = zeros(padded), zeros(padded), zeros(padded), zeros(padded)
        self.weights = packed(total), packed(total), packed(total)
        self.reaction = packed(total)
        self.inverse = packed(total)
        self.lean = packed(int(self.table[-1, LEAN]))
        self.marks: Marks = np.full(total, OWN, np.uint8)
        self.guests: Places = np.zeros(total, np.int32)
        self.hosts: Places = np.zeros(total, np.int32)
        self.cycle = packed(total), packed(total), packed(total)
        self.vectors = zeros(padded), zeros(padded), zeros(padded), zeros(padded), zeros(padded)
        self.label: Labels = np.zeros(padded, np.int32)
        self.parent: Labels = np.zeros(self.label.size + 1, np.int32)
        self.count: Labels = np.zeros(self.label.size + 1, np.int32)


Kind = tuple[tuple[int, int, int], tuple[bool, bool, bool]]
"""Cells and which axes are periodic: what decides the ghosts that buffers are left with."""

_spare: dict[Kind, list[Buffers]] = {}


def borrow(kind: Kind, owner: object) -> Buffers:
    """Buffers that go back into store when `owner` is gone."""
    store = _spare.setdefault(kind, [])
    try:
        buffers = store.pop()
    except IndexError:
        buffers = Buffers(kind[0])
    weakref.finalize(owner, store.append, buffers)
    return buffers


def prepare(
    hierarchy: Hierarchy,
    faces: tuple[Array, Array, Array],
    reaction: Array,
    finest: Finest,
    label: Labels,
    parent: Labels,
    count: Labels,
) -> tuple[int, float]:
    """Fill finest level, hierarchy and region labels from the weights on the faces.

    reaction  (cells) of K + D, which the hierarchy is made for; see `PressureSystem`
    returns  number of regions without an open side, scale of the hierarchy's weights
    """
    *weights, diagonal = finest
    finest_weights(faces, (weights[0], weights[1], weights[2]), diagonal)
    most = largest(diagonal)
    scale = 1.0 / most if most > 0.0 else 1.0
    for source, target in zip(weights, hierarchy[2], strict=True):
        scaled(source, target[: source.size], scale)
    added = at_level(hierarchy[3], hierarchy[0], 0)
    added[:] = 0.0
    d = 1 if added.shape[0] > 1 else 0
    if reaction.size:
        inner = added[d : added.shape[0] - d, 1:-1, 1:-1]
        inner[:] = scale * reaction.reshape(inner.shape)
    coarsen(hierarchy)
    return label_regions(finest, hierarchy[1], label, parent, count), scale


class PressureSystem:
    """The matrix for one geometry: build once, solve for any right-hand side and coupling.

    weights   face weights (nx+1, ny, nz), (nx, ny+1, nz), (nx, ny, nz+1), at least 0. On the outer
              faces of an axis that is not periodic a weight above 0 is an open side, p = 0 on it,
              at the distance that the weight was made with; a periodic axis has the same weights on
              its first and last face. A cell is active when one of its weights is above 0.
    periodic  of each axis
    reaction  (nx, ny, nz), at least 0: D with K + D closer than K to the matrix that is solved, as
              flesh gives way to pressure all over its skin; for the preconditioner alone
    raises    ValueError for one cell along x or y in 3D, which the ghost layout has no room for
    """

    def __init__(
        self,
        weights: Faces,
        periodic: tuple[bool, bool, bool] = (False, False, False),
        reaction: Array = NO_REACTION,
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
        self._coupled: tuple[Coupling, Coupled] | None = None
        self.buffers = borrow((inner, wraps), self)
        b = self.buffers
        self.hierarchy = (
            b.table,
            self.periodic,
            b.weights,
            b.reaction,
            b.inverse,
            b.lean,
            b.marks,
            b.guests,
            b.hosts,
        )
        self.regions, self.scale = prepare(
            self.hierarchy, faces, reaction, b.finest, b.label, b.parent, b.count
        )

    def solve(
        self,
        rhs: Array,
        guess: Array | None = None,
        coupling: Coupling = UNCOUPLED,
        tolerance: float = 1e-9,
        absolute: float = 0.0,
    ) -> PressureSolution:
        """Solve to  |rhs - A p| <= max(tolerance |rhs|, absolute).

        rhs, guess  (nx, ny, nz); values in cells without an open face are ignored
        """
        b = self.buffers
        inner = b.label.shape
        cells = (inner[0] - 2 if inner[0] > 1 else 1, inner[1] - 2, inner[2] - 2)
        diagonal = b.finest[3]
        x, right = b.vectors[:2]
        first = np.zeros(self.shape) if guess is None else np.ascontiguousarray(guess, np.float64)
        load_cells(x, first.reshape(cells), diagonal)
        load_cells(right, np.ascontiguousarray(rhs, np.float64).reshape(cells), diagonal)
        coupled = self.coupled(coupling)
        iterations, residual, converged = solve(
            self.hierarchy,
            b.cycle,
            b.finest,
            b.vectors,
            coupled.rows,
            coupling.response.arrays,
            b.label,
            coupled.null,
            coupled.fields,
            coupled.answers,
            tolerance,
            absolute,
        )
        start = (1 if inner[0] > 1 else 0, 1, 1)
        inside = tuple(slice(s, s + n) for s, n in zip(start, cells, strict=True))
        pressure = x[inside].copy().reshape(self.shape)
        return PressureSolution(pressure, int(iterations), float(residual), bool(converged))

    def coupled(self, coupling: Coupling) -> Coupled:
        """What the coupling adds; made when it is another than that of the last solve."""
        if self._coupled is None or self._coupled[0] is not coupling:
            self._coupled = coupling, self._couple(coupling)
        return self._coupled[1]

    def _couple(self, coupling: Coupling) -> Coupled:
        b, response = self.buffers, coupling.response
        diagonal = b.finest[3]
        rows = padded_rows(
            (coupling.cells, coupling.row_start, coupling.columns, coupling.values), diagonal
        )
        null, answers, fields = NO_VECTORS, NO_VECTORS, NO_FIELDS
        if self.regions:
            wrench = region_loads(b.label, self.regions, response.size, rows)
            null = null_basis(b.count[: self.regions], wrench, response)
        inverse = at_level(b.inverse, b.table, 0)
        held = null.shape[1] < self.regions
        modes = body_modes(response, rows, inverse, self.scale, max(self.shape), held)
        if modes.size:
            fields, gram = mode_fields(self.hierarchy, b.cycle, rows, modes)
            answers = mode_answers(modes, gram)
        return Coupled(rows, null, fields, answers)
