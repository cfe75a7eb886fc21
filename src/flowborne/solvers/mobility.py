"""The matrix A^-1 of a term of low rank, whole or by its factors.

    A^-1 = T ( (P^T L L^T P)^-1 - Y Y^T ) T^T

T leads from the unknowns of a factorised matrix to the k columns; Y takes out the motions of those
unknowns that constraints hold. A drag D that grows with the velocity makes it N = (A + D)^-1.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.sparse import csc_array, csr_array

from flowborne.kernels.arrays import ROUNDING, Array, MobilityArrays
from flowborne.kernels.cholesky import respond
from flowborne.solvers.cholesky import Cholesky, symmetric_factor


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
        return respond(np.ascontiguousarray(np.atleast_2d(load)), self.arrays).reshape(load.shape)

    def largest(self) -> float:
        """Size of the largest entry of A^-1; of a factorised one, of its compliant modes alone."""
        if self.is_dense:
            return float(np.abs(self.arrays[0]).max(initial=0.0))
        return float(np.square(self.compliant).sum(axis=1).max(initial=0.0)) or 1.0


def dense_mobility(matrix: Array) -> Mobility:
    """Of a dense A^-1 (k, k)."""
    whole = np.ascontiguousarray(matrix)
    share, axes = np.linalg.eigh(whole) if whole.any() else (np.zeros(len(whole)), whole)
    none, few, start = np.zeros(0, np.int64), np.zeros(0, np.int32), np.zeros(1, np.int32)
    blocks = none, none, few, none, few
    arrays = whole, start, few, np.zeros(0), np.zeros(0), blocks, none, np.zeros((0, 0))
    return Mobility(arrays, axes * np.sqrt(np.maximum(share, 0.0)))


@cache
def no_mobility(size: int) -> Mobility:
    """That of bodies whose motion is given."""
    return dense_mobility(np.zeros((size, size)))


def factored_mobility(
    jacobian: csr_array, factor: Cholesky, taken: Array, compliant: Array
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


Drag = Array | csr_array
"""D, dense for few unknowns."""


class DenseAnswer:
    """The answer of few unknowns, however large M or the drag are.

    With M = R R^T the drag D and  z = (1 + R^T D R)^-1 R^T J0,  an impulse J0 on bodies that keep
    their twist is  J = J0 - D R z  on bodies that change theirs by R z. J is taken from z where the
    bodies can move, which is free of the cancellation in J0 - D R z.

    mobility  (k, k) M, positive semidefinite, 1/kg
    drag      (k, k) D, positive semidefinite, kg
    yields    whether it moves anything
    """

    def __init__(self, mobility: Array, drag: Array) -> None:
        share, axes = np.linalg.eigh(mobility)
        moving = share > ROUNDING * len(share) * np.abs(share).max()
        self.root = axes[:, moving] * np.sqrt(share[moving])
        self.lift = axes[:, moving] / np.sqrt(share[moving])
        self.held = axes[:, ~moving]
        self.drag = drag
        self.inside = np.linalg.cholesky(np.eye(len(self.root.T)) + self.root.T @ drag @ self.root)
        part = np.linalg.solve(self.inside, self.root.T)
        self.compliance: Array = part.T @ part
        self.yields = bool(self.compliance.any())

    def change(self, push: Array) -> Array:
        """(k,) change N J0 of the motion for an impulse J0 (k,) on what keeps its own; N is exactly
        symmetric."""
        return np.asarray(self.compliance @ push)

    def to(self, push: Array) -> tuple[Array, Array]:
        """(k,) the same, and (k,) the impulse J that is felt by what gives way."""
        z = np.linalg.solve(self.inside.T, np.linalg.solve(self.inside, self.root.T @ push))
        change = self.root @ z
        impulse = self.lift @ z + self.held @ (self.held.T @ (push - self.drag @ change))
        return change, impulse


class SparseAnswer:
    """The answer of many unknowns, N = T (A + T^T D T)^-1 T^T, factorised anew.

    matrix    (n, n) A, symmetric positive definite
    jacobian  (k, n) T
    drag      (k, k) D, positive semidefinite, kg
    """

    def __init__(self, matrix: csr_array, jacobian: csr_array, drag: csr_array) -> None:
        self.drag, self.jacobian, self.transposed = drag, jacobian, jacobian.T
        self.factor = symmetric_factor(csc_array(matrix + self.transposed @ drag @ jacobian))
        self.yields = matrix.shape[0] > 0

    def change(self, push: Array) -> Array:
        """See `DenseAnswer`."""
        return np.asarray(self.jacobian @ self.factor.solve(self.transposed @ push))

    def to(self, push: Array) -> tuple[Array, Array]:
        """See `DenseAnswer`."""
        change = self.change(push)
        return change, push - self.drag @ change


Answering = DenseAnswer | SparseAnswer
"""The answer to a drag."""
