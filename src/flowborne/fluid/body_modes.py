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
def nearby_mass(rows: Rows, diagonal: Array, size: int) -> Array:
    """(size, size) G D^-1 G^T with the diagonal D of K: added mass of the nearest fluid only."""
    cells, row_start, columns, values = rows
    flat = diagonal.reshape(-1)
    gram = np.zeros((size, size))
    for n in range(cells.size):
        share = 1.0 / flat[cells[n]]
        for e in range(row_start[n], row_start[n + 1]):
            for f in range(row_start[n], row_start[n + 1]):
                gram[columns[e], columns[f]] += share * values[e] * values[f]
    return gram


@kernel
def nearby_mass_along(rows: Rows, diagonal: Array, root: Array) -> Array:
    """(m, m) R^T G D^-1 G^T R for motions R (k, m), without the (k, k) matrix between them."""
    cells, row_start, columns, values = rows
    flat = diagonal.reshape(-1)
    count = root.shape[1]
    gram, flux = np.zeros((count, count)), np.empty(count)
    for n in range(cells.size):
        flux[:] = 0.0
        for e in range(row_start[n], row_start[n + 1]):
            for a in range(count):
                flux[a] += values[e] * root[columns[e], a]
        for a in range(count):
            for b in range(count):
                gram[a, b] += flux[a] * flux[b] / flat[cells[n]]
    return gram


def body_modes(response: Response, rows: Rows, diagonal: Array, across: int) -> Array:
    """(k, m) R with R R^T equal to M but for motions that the fluid hardly feels.

    response  M
    diagonal  of K; what a motion moves of the nearest fluid is `nearby_mass`
    across    most cells along an axis: how much more than the nearest fluid a body may move
    """
    root = response.soft
    if response.is_dense:
        nearby = root.T @ nearby_mass(rows, diagonal, response.size) @ root
    else:
        nearby = nearby_mass_along(rows, diagonal, root)
    ratio, turned = np.linalg.eigh(nearby)
    chosen = np.flatnonzero(ratio * across > LIGHT)[-MOST:]
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
def let_bodies_answer(z: Array, rows: Rows, fields: Real, answers: Array) -> None:
    """z -= Y (1 + B^T Y)^-1 R^T G z  on a padded field z = V r.

    In double precision, because a light body leaves very little of z where it is pushed.
    """
    count, size = answers.shape
    if count == 0:
        return
    amount = np.zeros(count)
    wrench = wrench_of(z, rows, size)
    for n in range(count):
        for c in range(size):
            amount[n] += answers[n, c] * wrench[c]
    for i in prange(z.shape[0]):
        for n in range(count):
            for j in range(z.shape[1]):
                for k in range(z.shape[2]):
                    z[i, j, k] -= amount[n] * fields[n, i, j, k]
