"""The sparse factor, against dense arithmetic."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array, eye_array, kron, random_array

from flowborne.kernels.cholesky import solve_factored
from flowborne.solvers.cholesky import WIDEST, cholesky, ordering_of

from .references.cholesky import lower_reference


def scattered(n: int, seed: int) -> csr_array:
    """A positive definite matrix with a few entries in each row, in groups of three."""
    random = np.random.default_rng(seed)
    half = random_array((n // 3, n // 3), density=4.0 / n, rng=random).tocsr()
    blocks = kron(half + half.T + eye_array(n // 3), np.ones((3, 3)))
    A = csr_array(blocks)
    A.data = random.standard_normal(A.nnz)
    A = csr_array(A + A.T)
    return csr_array(A + eye_array(n) * (1.0 + abs(A).sum(axis=1).max()))


def line(n: int) -> csr_array:
    """A chain, all of whose blocks are one column wide."""
    return csr_array(4.0 * eye_array(n) - eye_array(n, k=1) - eye_array(n, k=-1))


def full(n: int) -> csr_array:
    """A full matrix: one run of columns with the same rows, cut into blocks."""
    half = np.random.default_rng(3).standard_normal((n, n))
    return csr_array(half @ half.T + n * np.eye(n))


@pytest.mark.parametrize(
    "A", [scattered(90, 1), scattered(300, 2), line(40), full(2 * WIDEST + 5), full(1)]
)
def test_factor(A: csr_array) -> None:
    """L L^T is the matrix in the order of the factor, and solving with it gives A^-1."""
    n = A.shape[0]
    factor = cholesky(A.data, ordering_of(A, np.arange(n)))
    place, blocks = factor.ordering.place, factor.ordering.blocks
    L = lower_reference(factor.value, blocks)
    assert np.array_equal(np.sort(place), np.arange(n))
    np.testing.assert_allclose((L @ L.T)[np.ix_(place, place)], A.toarray(), atol=1e-11)
    right = np.random.default_rng(0).standard_normal((n, 3))
    expected = np.linalg.solve(A.toarray(), right)
    np.testing.assert_allclose(factor.solve(right), expected, rtol=1e-9, atol=1e-11)
    np.testing.assert_allclose(factor.solve(right[:, 0]), expected[:, 0], rtol=1e-9, atol=1e-11)
    x = right.T.copy(order="C")
    solve_factored(x, factor.value, blocks)
    np.testing.assert_allclose(L @ (L.T @ x.T), right, atol=1e-10)


def test_dofs_left_out() -> None:
    A, free = scattered(90, 4), np.flatnonzero(np.arange(90) % 7 != 2)
    held = A[free][:, free]
    factor = cholesky(A.data, ordering_of(A, free))
    right = np.arange(float(len(free)))
    np.testing.assert_allclose(held @ factor.solve(right), right, atol=1e-11)


def test_nothing_free() -> None:
    A, none = scattered(9, 5), np.zeros(0, np.int64)
    factor = cholesky(A.data, ordering_of(A, none))
    assert factor.solve(np.zeros(0)).shape == (0,)


def test_what_is_not_positive_definite() -> None:
    A = scattered(90, 6)
    with pytest.raises(ArithmeticError, match="not positive definite"):
        cholesky(-A.data, ordering_of(A, np.arange(90)))
