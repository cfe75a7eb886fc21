"""Compliant modes in the preconditioner.

A V-cycle V on K alone is a poor guide to  K + J A^-1 J^T  where the term of low rank outweighs K.
With A^-1 = R R^T and B = J R,

    (V^-1 + B B^T)^-1  =  V - Y (1 + B^T Y)^-1 Y^T        Y = V B

takes in every mode, a column of R, at the price of a V-cycle each (Woodbury's identity). Modes that
weigh little against K are left out.
"""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Hierarchy, Real, Rows
from flowborne.kernels.levels import at_level
from flowborne.kernels.sparse_rows import add_rows, row_gram, row_gram_along, sum_rows
from flowborne.kernels.v_cycle import v_cycle
from flowborne.kernels.vectors import scaled_cells
from flowborne.solvers.mobility import Mobility

MOST_MODES = 32
"""Modes that are taken in, the most compliant first; more would cost more than they save."""

LEAST_WEIGHT = 0.5
"""A mode is left out when its term cannot weigh more than this against K."""

LEAST_WEIGHT_FACTORED = 100.0
"""The same where the V-cycle knows the diagonal of the term, as it does for a factorised A^-1:
iterations that a mode of less would save cost less than it does."""


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
    """Y (m, padded shape) with ghosts 0, and B^T Y (m, m) for modes (k, m)."""
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


def mode_amounts(modes: Array, gram: Array) -> Array:
    """(m, k) (1 + B^T Y)^-1 R^T: how much of each field to take off for a load J^T V r.

    gram  (m, m) B^T Y
    """
    matrix = np.eye(len(gram)) + gram
    scale = 1.0 / np.sqrt(np.diag(matrix))
    inverse: Array = scale[:, None] * np.linalg.inv(scale[:, None] * matrix * scale) * scale
    return inverse @ modes.T
