"""Conjugate gradients on K + G^T M G, preconditioned by one V-cycle on K.

All vectors are padded (see `levels`); sums run plane after plane, so that they do not depend on
how many threads there are.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from flowborne.fluid.arrays import Hierarchy, Labels, Real, Rows, Triple
from flowborne.fluid.body_modes import answers_of, push, with_answers, wrench_of
from flowborne.fluid.grid import Array
from flowborne.fluid.jit import kernel
from flowborne.fluid.levels import at_level, scaled, wrap_ghosts
from flowborne.fluid.multigrid import v_cycle
from flowborne.fluid.regions import remove_null
from flowborne.fluid.response import Answers, respond

Finest = tuple[Array, Array, Array, Array]
"""Padded weights across each axis and diagonal of the finest level."""

Vectors = tuple[Array, Array, Array, Array, Array]

LIMIT = 500
"""Most iterations."""

STAGNATION = 0.5
"""A restart from the true residual that has not fallen below this times the last ends the solve."""


@kernel
def apply_laplacian(out: Array, p: Array, finest: Finest) -> float:
    """out = K p; returns p . K p.  Ghosts of p hold what lies beyond the sides."""
    w0, w1, w2, diagonal = finest
    d = 1 if p.shape[0] > 1 else 0
    n2 = p.shape[2] - 2
    planes = p.shape[0] - 2 * d
    parts = np.zeros(planes)
    for i in prange(planes):
        m = i + d
        row = np.zeros(n2 + 2)
        for j in range(1, p.shape[1] - 1):
            for k in range(1, n2 + 1):
                total = diagonal[m, j, k] * p[m, j, k] - w1[m, j, k] * p[m, j - 1, k]
                total -= w1[m, j + 1, k] * p[m, j + 1, k]
                total -= w2[m, j, k] * p[m, j, k - 1] + w2[m, j, k + 1] * p[m, j, k + 1]
                if d:
                    total -= w0[m, j, k] * p[m - 1, j, k] + w0[m + 1, j, k] * p[m + 1, j, k]
                out[m, j, k] = total
                row[k] += total * p[m, j, k]
        for k in range(n2 + 2):
            parts[i] += row[k]
    total = 0.0
    for i in range(planes):
        total += parts[i]
    return total


@kernel
def apply_coupling(out: Array, p: Array, rows: Rows, answers: Answers) -> float:
    """out += G^T M G p; returns p . G^T M G p."""
    size = max(answers[0].shape[0], answers[1].size - 1)
    wrench = wrench_of(p, rows, size)
    motion = respond(wrench, answers)
    energy = 0.0
    for a in range(size):
        energy += motion[a] * wrench[a]
    push(out, rows, motion)
    return energy


@kernel
def dot(a: Array, b: Array) -> float:
    """Sum of a x b, planes in order."""
    planes, size = a.shape[0], a.shape[2]
    parts = np.zeros(planes)
    for i in prange(planes):
        row = np.zeros(size)
        for j in range(a.shape[1]):
            for k in range(size):
                row[k] += a[i, j, k] * b[i, j, k]
        for k in range(size):
            parts[i] += row[k]
    total = 0.0
    for i in range(planes):
        total += parts[i]
    return total


@kernel
def descend(x: Array, r: Array, p: Array, q: Array, alpha: float) -> float:
    """x += alpha p, r -= alpha q; returns r . r."""
    planes, size = r.shape[0], r.shape[2]
    parts = np.zeros(planes)
    for i in prange(planes):
        row = np.zeros(size)
        for j in range(r.shape[1]):
            for k in range(size):
                x[i, j, k] += alpha * p[i, j, k]
                value = r[i, j, k] - alpha * q[i, j, k]
                r[i, j, k] = value
                row[k] += value * value
        for k in range(size):
            parts[i] += row[k]
    total = 0.0
    for i in range(planes):
        total += parts[i]
    return total


@kernel
def turn(p: Array, z: Array, beta: float) -> None:
    """p = z + beta p."""
    for i in prange(p.shape[0]):
        for j in range(p.shape[1]):
            for k in range(p.shape[2]):
                p[i, j, k] = z[i, j, k] + beta * p[i, j, k]


@kernel
def true_residual(r: Array, rhs: Array, q: Array) -> float:
    """r = rhs - q; returns r . r."""
    for i in prange(r.shape[0]):
        for j in range(r.shape[1]):
            for k in range(r.shape[2]):
                r[i, j, k] = rhs[i, j, k] - q[i, j, k]
    return dot(r, r)


@kernel
def solve(
    hierarchy: Hierarchy,
    cycle: Triple,
    finest: Finest,
    vectors: Vectors,
    rows: Rows,
    response: Answers,
    label: Labels,
    null: Array,
    fields: Real,
    answers: Array,
    tolerance: float,
    absolute: float,
) -> tuple[int, float, bool]:
    """Solve (K + G^T M G) x = rhs from the guess in x; all of it on one thread, or on all.

    hierarchy  of K in the precision of the preconditioner, at any scale; cycle: its x, b, r
    finest     padded weights and diagonal of K
    vectors    padded x and rhs, scratch r, p, q with ghosts 0; rhs loses its part along the null
               vectors, x as well at the end
    rows       of G^T with padded flat cells (see `apply_coupling`); response: M (see `response`)
    null       see `regions.null_basis`
    fields, answers  of the motions in the preconditioner, at the scale of the hierarchy; see
               `body_modes`
    returns    iterations, |rhs - A x| / |rhs|, whether the residual asked for was reached
    """
    table, periodic = hierarchy[0], hierarchy[1]
    x, rhs, r, p, q = vectors
    norm0 = np.sqrt(dot(rhs, rhs))
    remove_null(rhs, label, null)
    norm = np.sqrt(dot(rhs, rhs))
    goal = max(tolerance * norm, absolute, 1e-15 * norm0)
    residual, last = 0.0, np.inf
    z, b = at_level(cycle[0], table, 0), at_level(cycle[1], table, 0)
    iterations = 0
    converged = False
    if not norm > goal:
        x[:] = 0.0
        return 0, 1.0 if norm > 0.0 else norm, norm <= goal
    while True:
        remove_null(x, label, null)
        wrap_ghosts(x, periodic)
        apply_laplacian(q, x, finest)
        apply_coupling(q, x, rows, response)
        true_residual(r, rhs, q)
        remove_null(r, label, null)
        square = dot(r, r)
        residual = np.sqrt(square)
        converged = residual <= goal
        if converged or not residual < STAGNATION * last or iterations >= LIMIT:
            break
        last = residual
        p[:] = 0.0
        product = 0.0
        while np.sqrt(square) > goal and iterations < LIMIT:
            scale = 1.0 / np.sqrt(square)
            scaled(r, b, scale)
            v_cycle(hierarchy, cycle[0], cycle[1], cycle[2])
            amount = answers_of(z, rows, answers, 1.0 / scale)
            before, product = product, with_answers(q, z, r, 1.0 / scale, amount, fields)
            turn(p, q, product / before if before > 0.0 else 0.0)
            wrap_ghosts(p, periodic)
            curvature = apply_laplacian(q, p, finest)
            curvature += apply_coupling(q, p, rows, response)
            if not (curvature > 0.0 and product > 0.0):
                break
            square = descend(x, r, p, q, product / curvature)
            iterations += 1
    return iterations, residual / norm, converged
