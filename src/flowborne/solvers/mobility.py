"""The matrix A^-1 of a term of low rank, whole or by its factors.

    A^-1 = T ( (P^T L L^T P)^-1 - Y Y^T ) T^T

T leads from the unknowns of a factorised matrix to the k columns; Y takes out the motions of those
unknowns that constraints hold.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from flowborne.kernels.arrays import Array, MobilityArrays
from flowborne.kernels.cholesky import respond
from flowborne.solvers.cholesky import Cholesky


@dataclass(frozen=True)
class Mobility:
    """A^-1 (k, k), symmetric positive semidefinite.

    arrays     for kernels; the factors are empty where A^-1 is dense, and it is where they are not
    compliant  (k, m) R with R R^T close to A^-1 for the modes that meet little resistance
    """

    arrays: MobilityArrays
    compliant: Array

    @property
    def size(self) -> int:
        """k."""
        return max(len(self.arrays[0]), len(self.arrays[1]) - 1)

    @property
    def is_dense(self) -> bool:
        return len(self.arrays[1]) == 1

    @property
    def yields(self) -> bool:
        """Whether a load moves anything: not where the motion of all bodies is given."""
        return not self.is_dense or bool(self.arrays[0].any())

    def times(self, load: Array) -> Array:
        """A^-1 applied to a load (k,), or to every row of (n, k)."""
        if self.is_dense:
            return np.asarray(load @ self.arrays[0])
        answers = np.zeros_like(load)
        for row, answer in zip(np.atleast_2d(load), np.atleast_2d(answers), strict=True):
            answer[:] = respond(np.ascontiguousarray(row), self.arrays)
        return answers

    def largest(self) -> float:
        """Size of the largest entry of A^-1; of a factorised one, of its compliant modes alone."""
        if self.is_dense:
            return float(np.abs(self.arrays[0]).max(initial=0.0))
        return float(np.square(self.compliant).sum(axis=1).max(initial=0.0)) or 1.0


NONE = np.zeros(0, np.int32)
START = np.zeros(1, np.int32)


def dense_mobility(matrix: Array) -> Mobility:
    """Of a dense A^-1 (k, k)."""
    whole = np.ascontiguousarray(matrix)
    share, axes = np.linalg.eigh(whole) if len(whole) else (np.zeros(0), whole)
    none = np.zeros(0, np.int64)
    blocks = none, none, NONE, none, NONE
    arrays = whole, START, NONE, np.zeros(0), np.zeros(0), blocks, none, np.zeros((0, 0))
    return Mobility(arrays, axes * np.sqrt(np.maximum(share, 0.0)))


def factored_mobility(
    jacobian: csr_array,
    factor: Cholesky,
    taken: Array,
    compliant: Array,
) -> Mobility:
    """Of a factorised matrix.

    jacobian  (k, n) T
    factor    L, and P
    taken     (n, c) Y;  compliant  see `Mobility`
    """
    starts, columns = jacobian.indptr.astype(np.int32), jacobian.indices.astype(np.int32)
    ordering, Y = factor.ordering, np.ascontiguousarray(taken)
    arrays = (
        np.zeros((0, 0)), starts, columns, jacobian.data,
        factor.value, ordering.blocks, ordering.place, Y,
    )  # fmt: skip
    return Mobility(arrays, np.ascontiguousarray(compliant))
