"""What the preconditioner knows of the bodies.

A V-cycle V on K alone is a poor guide to  K + G^T M G  where the bodies are light: pressure finds
it far easier to add_rows them than the fluid they displace. With M = R R^T and B = G^T R,

    (V^-1 + B B^T)^-1  =  V - Y (1 + B^T Y)^-1 Y^T        Y = V B

takes in every motion of the bodies at the price of a V-cycle each (Woodbury's identity).
"""

from __future__ import annotations

import numpy as np

from flowborne.fluid.grid import Array
from flowborne.fluid.response import Response
from flowborne.kernels.arrays import Hierarchy, Real, Rows
from flowborne.kernels.levels import at_level
from flowborne.kernels.sparse_rows import add_rows, row_gram, row_gram_along, sum_rows
from flowborne.kernels.v_cycle import v_cycle
from flowborne.kernels.vectors import scaled_cells

MOST = 32
"""Motions that are taken in, the lightest first; more would cost more than they save."""

LIGHT = 0.5
"""A motion is left out when the fluid that it moves cannot have more than this times its mass."""

LIGHT_IN_FLESH = 100.0
"""The same where the V-cycle knows how flesh gives way: iterations that a motion of less would save
cost less than it does."""


def body_modes(
    response: Response, rows: Rows, inverse: Real, scale: float, across: int, held: bool
) -> Array:
    """(k, m) R with R R^T equal to scale x M but for motions that the fluid hardly feels.

    response  M
    inverse   padded: of the diagonal that the V-cycle is made for, which knows how flesh gives way;
              what a motion moves of the nearest fluid is `row_gram` with it
    scale     of the hierarchy's weights
    across    most cells along an axis: how much more than the nearest fluid a body may move
    held      whether a region's pressure has no hold but bodies, which no V-cycle knows
    """
    root = np.sqrt(scale) * response.soft
    if response.is_dense:
        nearby = root.T @ row_gram(rows, inverse, response.size) @ root
    else:
        nearby = row_gram_along(rows, inverse, root)
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
        add_rows(source, rows, np.ascontiguousarray(modes[:, n]))
        v_cycle(hierarchy, *cycle)
        scaled_cells(z, fields[n], 1.0)
        gram[:, n] = sum_rows(z, rows, size) @ modes
    return fields, gram


def mode_answers(modes: Array, gram: Array) -> Array:
    """(m, k) (1 + B^T Y)^-1 R^T: how much of each field to take off for a wrench G V r.

    gram  (m, m) B^T Y
    """
    matrix = np.eye(len(gram)) + gram
    scale = 1.0 / np.sqrt(np.diag(matrix))
    inverse: Array = scale[:, None] * np.linalg.inv(scale[:, None] * matrix * scale) * scale
    return inverse @ modes.T
