"""How a system answers a drag that grows with its velocity: N = (M^-1 + D)^-1."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from scipy.sparse import csc_array, csr_array

from flowborne.kernels.arrays import ROUNDING, Array
from flowborne.solvers.cholesky import symmetric_factor

Drag = Array | csr_array
"""D, dense for few unknowns."""


class Answering(Protocol):
    """The answer to a drag D (k, k), kg."""

    yields: bool
    """Whether it moves anything."""

    def change(self, push: Array) -> Array:
        """(k,) change N J0 of the motion for an impulse J0 (k,) on what keeps its own."""
        ...

    def to(self, push: Array) -> tuple[Array, Array]:
        """(k,) the same, and (k,) the impulse J that is felt by what gives way."""
        ...


class DenseAnswer:
    """The answer of few unknowns, however large M or the drag are.

    With M = R R^T the drag D and  z = (1 + R^T D R)^-1 R^T J0,  an impulse J0 on bodies that keep
    their twist is  J = J0 - D R z  on bodies that change theirs by R z. J is taken from z where the
    bodies can move, which is free of the cancellation in J0 - D R z.

    mobility  (k, k) M, positive semidefinite, 1/kg
    drag      (k, k) D, positive semidefinite, kg
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
        """See `Answering`; by N (k, k), exactly symmetric."""
        return np.asarray(self.compliance @ push)

    def to(self, push: Array) -> tuple[Array, Array]:
        """See `Answering`."""
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
        """See `Answering`."""
        return np.asarray(self.jacobian @ self.factor.solve(self.transposed @ push))

    def to(self, push: Array) -> tuple[Array, Array]:
        """See `Answering`."""
        change = self.change(push)
        return change, push - self.drag @ change
