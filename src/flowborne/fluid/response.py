"""How what moves in the fluid answers impulses: the matrix M, whole or by its factors.

M                                       a few rigid bodies
M = T ( (P^T L D L^T P)^-1 - Y Y^T ) T^T    flesh: T from its dofs to the velocities that the
                                        fluid sees, and a factorised matrix of which Y takes out
                                        what contacts hold
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from flowborne.fluid.grid import Array
from flowborne.kernels.arrays import Answers, Integers
from flowborne.kernels.response import respond

Places = NDArray[np.int32]


@dataclass(frozen=True)
class Response:
    """M (k, k), symmetric positive semidefinite.

    arrays  for kernels; the factors are empty where M is dense, and M is where they are not
    soft    (k, m) R with R R^T close to M for the motions that meet little resistance
    """

    arrays: Answers
    soft: Array

    @property
    def size(self) -> int:
        """k."""
        return max(len(self.arrays[0]), len(self.arrays[1]) - 1)

    @property
    def is_dense(self) -> bool:
        return len(self.arrays[1]) == 1

    def times(self, push: Array) -> Array:
        """M applied to a push (k,), or to every row of (n, k)."""
        if self.is_dense:
            return np.asarray(push @ self.arrays[0])
        answers = np.zeros_like(push)
        for row, answer in zip(np.atleast_2d(push), np.atleast_2d(answers), strict=True):
            answer[:] = respond(np.ascontiguousarray(row), self.arrays)
        return answers

    def largest(self) -> float:
        """Size of the largest entry of M; for flesh, of what its dofs would do one by one."""
        if self.is_dense:
            return float(np.abs(self.arrays[0]).max(initial=0.0))
        return float(np.square(self.soft).sum(axis=1).max(initial=0.0)) or 1.0


NONE = np.zeros(0, np.int32)
START = np.zeros(1, np.int32)


def dense_response(matrix: Array) -> Response:
    """Of a dense M (k, k)."""
    whole = np.ascontiguousarray(matrix)
    share, axes = np.linalg.eigh(whole) if len(whole) else (np.zeros(0), whole)
    arrays = (
        whole, START, NONE, np.zeros(0), START, NONE, np.zeros(0), np.zeros(0),
        np.zeros(0, np.int64), np.zeros((0, 0)),
    )  # fmt: skip
    return Response(arrays, axes * np.sqrt(np.maximum(share, 0.0)))


def factored_response(
    jacobian: csr_array,
    lower: tuple[Places, Places, Array],
    diagonal: Array,
    order: Integers,
    taken: Array,
    soft: Array,
) -> Response:
    """Of a factorised matrix.

    jacobian  (k, n) T
    lower     columns of L (n, n) below its diagonal of ones: start, row, value
    diagonal  (n,) D;  order  (n,) place of each dof in L
    taken     (n, c) Y;  soft  see `Response`
    """
    starts, columns = jacobian.indptr.astype(np.int32), jacobian.indices.astype(np.int32)
    arrays = (
        np.zeros((0, 0)), starts, columns, jacobian.data, *lower, diagonal,
        order.astype(np.int64), np.ascontiguousarray(taken),
    )  # fmt: skip
    return Response(arrays, np.ascontiguousarray(soft))
