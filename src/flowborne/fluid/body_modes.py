"""What the preconditioner knows of the bodies.

A V-cycle V on K alone is a poor guide to  K + G^T M G  where the bodies are light: pressure finds
it far easier to push them than the fluid they displace. With M = R R^T and B = G^T R,

    (V^-1 + B B^T)^-1  =  V - Y (1 + B^T Y)^-1 Y^T        Y = V B

takes in every motion of the bodies at the price of a V-cycle each (Woodbury's identity).
"""

from __future__ import annotations

import numpy as np
from numba import prange

from flowborne.fluid.arrays import Hierarchy, Real, Rows
from flowborne.fluid.grid import Array
from flowborne.fluid.jit import kernel
from flowborne.fluid.levels import at_level, scaled_cells
from flowborne.fluid.multigrid import v_cycle
from flowborne.fluid.response import Response

MOST = 32
"""Motions that are taken in, the lightest first; more would cost more than they save."""

LIGHT = 0.5
"""A motion is left out when the fluid that it moves cannot have more than this times its mass."""

LIGHT_IN_FLESH = 100.0
"""The same where the V-cycle knows how flesh gives way: iterations that a motion of less would save
cost less than it does."""


@kernel
def wrench_of(p: Real, rows: Rows, size: int) -> Array:
    """(size,) G p of a padded field."""
    cells, row_start, columns, values = rows
    flat = p.reshape(-1)
    wrench = np.zeros(size)
    for n in range(cells.size):
        value = flat[cells[n]]
        for e in range(row_start[n], row_start[n + 1]):
            wrench[columns[e]] += values[e] * value
    return wrench


@kernel
def push(p: Real, rows: Rows, twist: Array) -> None:
    """p += G^T twist on a padded field."""
    cells, row_start, columns, values = rows
    flat = p.reshape(-1)
    for n in range(cells.size):
        total = 0.0
        for e in range(row_start[n], row_start[n + 1]):
            total += values[e] * twist[columns[e]]
        flat[cells[n]] += total


@kernel
def nearby_mass(rows: Rows, inverse: Real, size: int) -> Array:
    """(size, size) G D^-1 G^T for a padded D^-1: added mass of the nearest fluid only."""
    cells, row_start, columns, values = rows
    flat = inverse.reshape(-1)
    gram = np.zeros((size, size))
    for n in range(cells.size):
        share = flat[cells[n]]
        for e in range(row_start[n], row_start[n + 1]):
            for f in range(row_start[n], row_start[n + 1]):
                gram[columns[e], columns[f]] += share * values[e] * values[f]
    return gram


@kernel
def nearby_mass_along(rows: Rows, inverse: Real, root: Array) -> Array:
    """(m, m) R^T G D^-1 G^T R for motions R (k, m), without the (k, k) matrix between them."""
    cells, row_start, columns, values = rows
    flat = inverse.reshape(-1)
    count = root.shape[1]
    gram, flux = np.zeros((count, count)), np.empty(count)
    for n in range(cells.size):
        flux[:] = 0.0
        for e in range(row_start[n], row_start[n + 1]):
            for a in range(count):
                flux[a] += values[e] * root[columns[e], a]
        for a in range(count):
            for b in range(count):
                gram[a, b] += flux[a] * flux[b] * flat[cells[n]]
    return gram


def body_modes(
    response: Response, rows: Rows, inverse: Real, scale: float, across: int, held: bool
) -> Array:
    """(k, m) R with R R^T equal to scale x M but for motions that the fluid hardly feels.

    response  M
    inverse   padded: of the diagonal that the V-cycle is made for, which knows how flesh gives way;
              what a motion moves of the nearest fluid is `nearby_mass` with it
    scale     of the hierarchy's weights
    across    most cells along an axis: how much more than the nearest fluid a body may move
    held      whether a region's pressure has no hold but bodies, which no V-cycle knows
    """
    root = np.sqrt(scale) * response.soft
    if response.is_dense:
        nearby = root.T @ nearby_mass(rows, inverse, response.size) @ root
    else:
        nearby = nearby_mass_along(rows, inverse, root)
    ratio, turned = np.linalg.eigh(nearby)
    light = LIGHT if response.is_dense or held else LIGHT_IN_FLESH
    chosen = np.flatnonzero(ratio * across > light)[-MOST:]
    return np.ascontiguousarray(root @ turned[:, chosen])


def mode_fields(
    hierarchy: Hierarchy, cycle: tuple[Real, Real, Real], rows: Rows, modes: Array
) -> tuple[Real, Array]:
    """Y (m, padded shape) with ghosts 0, and B^T Y (m, m) for motions (k, m)."""
    x, b, _ = cycle
    z, source = at_level(x, hierarchy[0], 0), at_level(b, hierarchy[0], 0)
    size, count = modes.shape
    fields = np.zeros((count, *z.shape), z.dtype)
    gram = np.empty((count, count))
    for n in range(count):
        source[:] = 0.0
        push(source, rows, np.ascontiguousarray(modes[:, n]))
        v_cycle(hierarchy, *cycle)
        scaled_cells(z, fields[n], 1.0)
        gram[:, n] = wrench_of(z, rows, size) @ modes
    return fields, gram


def mode_answers(modes: Array, gram: Array) -> Array:
    """(m, k) (1 + B^T Y)^-1 R^T: how much of each field to take off for a wrench G V r.

    gram  (m, m) B^T Y
    """
    matrix = np.eye(len(gram)) + gram
    scale = 1.0 / np.sqrt(np.diag(matrix))
    inverse: Array = scale[:, None] * np.linalg.inv(scale[:, None] * matrix * scale) * scale
    return inverse @ modes.T


@kernel
def answers_of(z: Real, rows: Rows, answers: Array, scale: float) -> Array:
    """(m,) (1 + B^T Y)^-1 R^T G z x scale for a padded field z = V r."""
    count, size = answers.shape
    amount = np.zeros(count)
    if count:
        wrench = scale * wrench_of(z, rows, size)
        for n in range(count):
            for c in range(size):
                amount[n] += answers[n, c] * wrench[c]
    return amount


@kernel
def with_answers(out: Array, z: Real, r: Array, scale: float, amount: Array, fields: Real) -> float:
    """out = scale z - Y amount in the cells; returns out . r.

    In double precision, because a light body leaves very little of z where it is pushed.

    NumPy:  out[cells] = (scale * z - np.tensordot(amount, fields, 1))[cells]
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
            for n in range(amount.size):
                for k in range(1, last):
                    out[m, j, k] -= amount[n] * fields[n, m, j, k]
            for k in range(1, last):
                row[k] += out[m, j, k] * r[m, j, k]
        for k in range(1, last):
            parts[i] += row[k]
    total = 0.0
    for i in range(planes):
        total += parts[i]
    return total
