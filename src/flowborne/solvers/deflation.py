"""Compliant modes in the preconditioner, and null vectors of the operator.

A V-cycle V on K alone is a poor guide to  K + J A^-1 J^T  where the term of low rank outweighs K.
With A^-1 = R R^T and B = J R,

    (V^-1 + B B^T)^-1  =  V - Y (1 + B^T Y)^-1 Y^T        Y = V B

takes in every mode, a column of R, at the price of a V-cycle each (Woodbury's identity). Modes that
weigh little against K are left out.

In a region without an open side K knows the unknown only up to a constant. A sum of such constants,
c_r in region r, is a null vector when A^-1 is 0 on the load  J^T (sum of c_r 1_r).
"""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Hierarchy, Labels, Real, Rows
from flowborne.kernels.levels import at_level
from flowborne.kernels.regions import NULL
from flowborne.kernels.sparse_rows import add_rows, row_gram, row_gram_along, sum_rows
from flowborne.kernels.v_cycle import v_cycle
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
    inside = tuple(slice(1, -1) if n > 1 else slice(None) for n in z.shape)
    size, count = modes.shape
    fields = np.zeros((count, *z.shape), z.dtype)
    gram = np.empty((count, count))
    for n in range(count):
        source[:] = 0.0
        add_rows(source, rows, np.ascontiguousarray(modes[:, n]))
        v_cycle(hierarchy, *cycle)
        fields[n][inside] = z[inside]
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
