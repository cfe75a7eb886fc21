"""Sparse Cholesky factors of matrices that have their entries in the same places again and again.

The order of the unknowns and the places of the factor's entries are found once, by SuperLU's
minimum degree; a factor after that costs its arithmetic alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.sparse import csc_array, csr_array, diags_array
from scipy.sparse.linalg import SuperLU, splu

from flowborne.kernels.arrays import Array, Blocks, Indices, Integers
from flowborne.kernels.cholesky import factorise, solve_factored

WIDEST = 32
"""Most columns of a block."""


@dataclass(frozen=True)
class Ordering:
    """Where the entries of a factor are.

    place   (n,) number of each unknown in L
    blocks  of L, see `kernels.arrays.Blocks`
    within  see `kernels.cholesky.give_update`
    slot    where in the values of L each of the matrix belongs, -1 for none
    """

    place: Integers
    blocks: Blocks
    within: Indices
    slot: Integers


@dataclass(frozen=True)
class Cholesky:
    """L of one matrix, and its ordering."""

    ordering: Ordering
    value: Array

    def solve(self, right: Array) -> Array:
        """The matrix's inverse times `right` (n,) or (n, k)."""
        place = self.ordering.place
        turned = np.empty(np.atleast_2d(right.T).shape)
        turned[:, place] = right.T
        solve_factored(turned, self.value, self.ordering.blocks)
        return np.ascontiguousarray(turned[:, place].T).reshape(right.shape)


def ordering_of(matrix: csr_array, free: Integers) -> Ordering:
    """Of the rows and columns `free` (n,) of symmetric matrices that have their entries where this
    one has them; its values do not matter."""
    n = len(free)
    likely = csc_array(matrix[free][:, free])
    likely.data[:] = -1.0
    likely = csc_array(likely + diags_array(2.0 + np.diff(likely.indptr)))  # nothing cancels in L
    factor = symmetric_factor(likely)
    place = factor.perm_c.astype(np.int64)
    L = csc_array(factor.L)
    L.sort_indices()
    column, count = np.arange(n), np.diff(L.indptr)
    beneath = np.full(n, -1)
    beneath[count > 1] = L.indices[L.indptr[:-1][count > 1] + 1]
    alike = np.zeros(n, bool)  # a column has the rows of the one before but for itself
    alike[1:] = (count[1:] == count[:-1] - 1) & (beneath[:-1] == column[1:])
    run = np.maximum.accumulate(np.where(alike, 0, column))
    first = np.flatnonzero((column - run) % WIDEST == 0)
    width = np.diff(np.append(first, n))
    last = first + width - 1
    height = count[last] - 1
    rows = [L.indices[L.indptr[c] + 1 : L.indptr[c + 1]] for c in last]
    blocks = (
        np.append(first, n),
        _from_zero(height),
        np.concatenate([np.zeros(0), *rows]).astype(np.int32),
        _from_zero(width * (width + height)),
        np.repeat(np.arange(len(first)), width).astype(np.int32),
    )
    row = np.repeat(np.arange(matrix.shape[0]), np.diff(matrix.indptr))
    number = np.full(matrix.shape[0], -1)
    number[free] = place
    return Ordering(place, blocks, *_inside(blocks, number[matrix.indices], number[row]))


def _inside(blocks: Blocks, r: Integers, c: Integers) -> tuple[Indices, Integers]:
    """`Ordering.within`, and `slot` of entries in these rows and columns of L, -1 if left out."""
    first, below, rows, at, owner = blocks
    n, width, height = owner.size, np.diff(first), np.diff(below)
    known = np.repeat(np.arange(len(width)), height) * n + rows
    slot, lower = np.full(len(r), -1), np.flatnonzero((c >= 0) & (r >= c))
    r, c = r[lower], c[lower]
    s = owner[c].astype(np.int64)
    number = np.searchsorted(known, s * n + r) - below[s]
    beneath = width[s] ** 2 + (c - first[s]) * height[s] + number
    triangle = (c - first[s]) * width[s] + r - first[s]
    slot[lower] = at[s] + np.where(r < first[s + 1], triangle, beneath)
    within = [np.zeros(0, np.int64)]
    for low, high in pairwise(below):
        for target in np.unique(owner[rows[low:high]]).astype(np.int64):
            beyond = low + np.searchsorted(rows[low:high], first[target + 1])
            found = np.searchsorted(known, target * n + rows[beyond:high])
            within.append(found - below[target])
    return np.concatenate(within).astype(np.int32), slot


def _from_zero(sizes: Integers) -> Integers:
    """Where each of pieces of these sizes begins, and the end."""
    return np.concatenate([[0], np.cumsum(sizes, dtype=np.int64)])


def cholesky(entry: Array, ordering: Ordering) -> Cholesky:
    """Factor of the matrix of these entries.

    raises  ArithmeticError when it is not positive definite
    """
    value = np.empty(int(ordering.blocks[3][-1]))
    if not factorise(value, ordering.blocks, ordering.within, ordering.slot, entry):
        raise ArithmeticError("the matrix is not positive definite")
    return Cholesky(ordering, value)


def symmetric_factor(matrix: csc_array) -> SuperLU:
    """SuperLU of a symmetric positive definite matrix, in an order that keeps it sparse.

    The symmetric order holds only while every pivot is taken from the diagonal.
    """
    return splu(
        matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
