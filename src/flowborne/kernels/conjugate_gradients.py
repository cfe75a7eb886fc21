"""Conjugate gradients on K + J A^-1 J^T, preconditioned by one V-cycle on K and a deflation.

With Y = V B and C = (1 + B^T Y)^-1 R^T (see `solvers.pressure`) the preconditioned residual r is
V r - Y (C J^T V r). All vectors are padded (see `levels`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import prange

from flowborne.kernels.arrays import (
    ROUNDING,
    Array,
    DenseTerm,
    Hierarchy,
    Integers,
    Labels,
    MobilityArrays,
    Operator,
    Real,
    Rows,
    Triple,
    Vectors,
)
from flowborne.kernels.cholesky import respond
from flowborne.kernels.jit import inlined, kernel
from flowborne.kernels.levels import at_level, wrap_ghosts
from flowborne.kernels.regions import remove_null
from flowborne.kernels.smoothing import apply_laplacian, turn_and_apply
from flowborne.kernels.sparse_rows import add_rows, sum_rows
from flowborne.kernels.v_cycle import v_cycle
from flowborne.kernels.vectors import descend, dot, in_order, scaled, turn

LIMIT = 500
"""Most iterations."""

STAGNATION = 0.5
"""A restart from the true residual that has not fallen below this times the last ends the solve."""


class Matrix(NamedTuple):
    """K + J A^-1 J^T + U diag(s) U^T.

    finest    K on the finest level, with its diagonal
    rows      of J with padded flat cells
    mobility  A^-1, see `solvers.mobility`
    beyond    U and s: padded flat cells, vectors, strengths; see `add_term`
    label     region without an open side of each padded cell
    null      null vectors, see `solvers.deflation.null_basis`
    """

    finest: Operator
    rows: Rows
    mobility: MobilityArrays
    beyond: DenseTerm
    label: Labels
    null: Array


class Preconditioner(NamedTuple):
    """One V-cycle on K and a deflation, in its own precision, at any scale.

    hierarchy        of K;  cycle  its x, b, r
    fields, amounts  of the modes, see `solvers.deflation`
    """

    hierarchy: Hierarchy
    cycle: Triple
    fields: Real
    amounts: Array


LANES = 8
"""Partial sums of a scalar product, so that the compiler makes vector code of it."""


@inlined
def product(a: Array, b: Array) -> float:
    """a . b, in LANES sums."""
    parts, whole = np.zeros(LANES), a.size // LANES * LANES
    for start in range(0, whole, LANES):
        for lane in range(LANES):
            parts[lane] += a[start + lane] * b[start + lane]
    total = in_order(parts)
    for n in range(whole, a.size):
        total += a[n] * b[n]
    return total


@kernel
def add_term(out: Array, p: Array, cells: Integers, vectors: Array, strengths: Array) -> float:
    """out += U diag(s) U^T p between some cells; returns p . U diag(s) U^T p.

    cells      (n,) padded flat; a cell may be there several times
    vectors    (m, n) U^T
    strengths  (m,) s
    """
    flat, added = p.reshape(-1), out.reshape(-1)
    held, given, energy = np.empty(cells.size), np.zeros(cells.size), 0.0
    for n in range(cells.size):
        held[n] = flat[cells[n]]
    for m in range(strengths.size):
        vector = vectors[m]
        load = product(vector, held)
        motion = strengths[m] * load
        energy += motion * load
        for n in range(cells.size):
            given[n] += motion * vector[n]
    for n in range(cells.size):
        added[cells[n]] += given[n]
    return energy


@kernel
def mode_strengths(z: Real, rows: Rows, amounts: Array, scale: float) -> Array:
    """(m,) C J^T z x scale for a padded field z = V r and amounts C (m, k)."""
    count, size = amounts.shape
    strength = np.zeros(count)
    if count:
        load = sum_rows(z, rows, size)
        for n in range(count):
            for c in range(size):
                strength[n] += amounts[n, c] * (scale * load[c])
    return strength


@kernel
def deflated(out: Array, z: Real, r: Array, scale: float, strength: Array, fields: Real) -> float:
    """out = scale z - Y strength in the cells; returns out . r.

    In double precision, because a compliant mode leaves very little of z where it acts.
    """
    d = 1 if z.shape[0] > 1 else 0
    planes, last = z.shape[0] - 2 * d, z.shape[2] - 1
    parts = np.zeros(planes)
    for i in prange(planes):
        m = i + d
        row = np.zeros(last + 1)
        for j in range(1, z.shape[1] - 1):
            for k in range(1, last):
                out[m, j, k] = scale * z[m, j, k]
            for n in range(strength.size):
                for k in range(1, last):
                    out[m, j, k] -= strength[n] * fields[n, m, j, k]
            for k in range(1, last):
                row[k] += out[m, j, k] * r[m, j, k]
        for k in range(1, last):
            parts[i] += row[k]
    return in_order(parts)


@kernel
def apply_low_rank(out: Array, p: Array, rows: Rows, mobility: MobilityArrays) -> float:
    """out += J A^-1 J^T p; returns p . J A^-1 J^T p."""
    size = max(mobility[0].shape[0], mobility[1].size - 1)
    load = sum_rows(p, rows, size)
    motion = respond(load.reshape(1, size), mobility)[0]
    energy = 0.0
    for a in range(size):
        energy += motion[a] * load[a]
    add_rows(out, rows, motion)
    return energy


@kernel
def solve(
    matrix: Matrix,
    preconditioner: Preconditioner,
    vectors: Vectors,
    tolerance: float,
    absolute: float,
    guessed: bool,
    applied: bool,
) -> tuple[int, float, bool]:
    """Solve A x = rhs from the guess in x; all of it on one thread, or on all.

    vectors  padded x and rhs, scratch r, p, q with ghosts 0; rhs loses its part along the null
             vectors, x as well at the end; q is A x then, unless x = 0 without a guess
    guessed  whether x is other than 0
    applied  whether q is A x
    returns  iterations, |rhs - A x| / |rhs|, whether the residual asked for was reached
    """
    finest, rows, mobility, beyond, label, null = matrix
    hierarchy, cycle, fields, amounts = preconditioner
    table, periodic = hierarchy[0], hierarchy[1]
    x, rhs, r, p, q = vectors
    square = dot(rhs, rhs)
    rounding = ROUNDING * np.sqrt(square)
    if null.size:
        remove_null(rhs, label, null)
        square = dot(rhs, rhs)
    norm = np.sqrt(square)
    goal = max(tolerance * norm, absolute, rounding)
    residual, last = 0.0, np.inf
    z, b = at_level(cycle[0], table, 0), at_level(cycle[1], table, 0)
    ring = periodic.any()
    iterations = 0
    converged = False
    if not norm > goal:
        x[:] = 0.0
        return 0, 1.0 if norm > 0.0 else norm, norm <= goal
    while True:
        scaled(rhs, r, 1.0)
        if guessed or iterations:
            if not applied:
                remove_null(x, label, null)
                wrap_ghosts(x, periodic)
                apply_laplacian(q, x, finest)
                apply_low_rank(q, x, rows, mobility)
                add_term(q, x, *beyond)
            applied = False
            square = descend(None, r, None, q, 1.0)
            if null.size:
                remove_null(r, label, null)
                square = dot(r, r)
        residual = np.sqrt(square)
        converged = residual <= goal
        if converged or not residual < STAGNATION * last or iterations >= LIMIT:
            break
        last = residual
        p[:] = 0.0
        product = 0.0
        scale = 1.0 / np.sqrt(square)
        scaled(r, b, scale)
        while np.sqrt(square) > goal and iterations < LIMIT:
            v_cycle(hierarchy, cycle[0], cycle[1], cycle[2])
            before = product
            if amounts.size == 0 and not ring:
                product = dot(z, r, 1.0 / scale)
                beta = product / before if before > 0.0 else 0.0
                curvature = turn_and_apply(q, p, z, 1.0 / scale, beta, finest)
            else:
                strength = mode_strengths(z, rows, amounts, 1.0 / scale)
                product = deflated(q, z, r, 1.0 / scale, strength, fields)
                beta = product / before if before > 0.0 else 0.0
                if ring:
                    turn(p, q, beta)
                    wrap_ghosts(p, periodic)
                    curvature = apply_laplacian(q, p, finest)
                else:
                    curvature = turn_and_apply(q, p, q, 1.0, beta, finest)
            curvature += apply_low_rank(q, p, rows, mobility)
            curvature += add_term(q, p, *beyond)
            if not (curvature > 0.0 and product > 0.0):
                break
            scale = 1.0 / np.sqrt(square)
            square = descend(x, r, p, q, product / curvature, b, scale)
            iterations += 1
    return iterations, residual / norm, converged
