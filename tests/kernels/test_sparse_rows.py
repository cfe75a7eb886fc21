"""Sparse rows against their dense matrix, and the response to a load."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array

from flowborne.kernels.arrays import Rows
from flowborne.kernels.cholesky import respond
from flowborne.kernels.conjugate_gradients import apply_low_rank, mode_strengths
from flowborne.kernels.sparse_rows import add_rows, padded_rows, row_gram, row_gram_along, sum_rows
from flowborne.solvers.cholesky import cholesky, ordering_of
from flowborne.solvers.mobility import dense_mobility, factored_mobility

from .references.mobility import respond_reference
from .references.sparse_rows import dense_rows, padded_rows_reference

SHAPE, SIZE = (5, 4, 6), 7


def random_rows(count: int = 30, seed: int = 0) -> Rows:
    """Rows of none to four entries; some cells have several."""
    random = np.random.default_rng(seed)
    start = np.append(0, np.cumsum(random.integers(0, 5, count)))
    cells = np.sort(random.integers(0, np.prod(SHAPE), count))
    return cells, start, random.integers(0, SIZE, start[-1]), random.standard_normal(start[-1])


def test_sums_and_their_transpose() -> None:
    random, rows = np.random.default_rng(1), random_rows()
    J = dense_rows(rows, int(np.prod(SHAPE)), SIZE)
    p, motion = random.standard_normal(SHAPE), random.standard_normal(SIZE)
    np.testing.assert_allclose(sum_rows(p, rows, SIZE), J.T @ p.ravel(), atol=1e-13)
    expected = p.ravel() + J @ motion
    add_rows(p, rows, motion)
    np.testing.assert_allclose(p.ravel(), expected, atol=1e-13)


def test_a_term_of_low_rank_and_the_strength_of_modes() -> None:
    random, rows = np.random.default_rng(6), random_rows()
    J = dense_rows(rows, int(np.prod(SHAPE)), SIZE)
    p, out = random.standard_normal((2, *SHAPE))
    half, amounts = random.standard_normal((SIZE, SIZE)), random.standard_normal((3, SIZE))
    strength = mode_strengths(p, rows, amounts, 0.7)
    np.testing.assert_allclose(strength, 0.7 * amounts @ J.T @ p.ravel(), atol=1e-12)
    assert mode_strengths(p, rows, amounts[:0], 0.7).size == 0
    term = J @ (half @ half.T) @ (J.T @ p.ravel())
    expected = out.ravel() + term
    energy = apply_low_rank(out, p, rows, dense_mobility(half @ half.T).arrays)
    np.testing.assert_allclose(out.ravel(), expected, atol=1e-11)
    assert energy == pytest.approx(p.ravel() @ term)


def test_gram() -> None:
    """Each row on a cell of its own: rows of one cell are not added up."""
    random, rows = np.random.default_rng(2), random_rows()
    rows = (np.arange(30), *rows[1:])
    J, D = dense_rows(rows, int(np.prod(SHAPE)), SIZE), random.random(SHAPE)
    expected = J.T @ (D.ravel()[:, None] * J)
    np.testing.assert_allclose(row_gram(rows, D, SIZE), expected, atol=1e-13)
    root = random.standard_normal((SIZE, 3))
    np.testing.assert_allclose(row_gram_along(rows, D, root), root.T @ expected @ root, atol=1e-12)


@pytest.mark.parametrize("shape", [SHAPE, (1, 10, 12)])
def test_padded_rows(shape: tuple[int, int, int]) -> None:
    rows, random = random_rows(), np.random.default_rng(3)
    diagonal = random.random(tuple(n + 2 if n > 1 else 1 for n in shape))
    diagonal[random.random(diagonal.shape) < 0.3] = 0.0
    found, expected = padded_rows(rows, diagonal), padded_rows_reference(rows, diagonal)
    assert 0 < expected[0].size < rows[0].size
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_array_equal(one, other)


def test_dense_response() -> None:
    half, load = np.random.default_rng(4).standard_normal((2, SIZE, SIZE))
    mobility = dense_mobility(half @ half.T)
    expected = respond_reference(load[0], mobility.arrays)
    np.testing.assert_allclose(respond(load[:1], mobility.arrays)[0], expected, rtol=1e-12)
    np.testing.assert_allclose(mobility.times(load), load @ half @ half.T, rtol=1e-10, atol=1e-12)


def test_factored_response() -> None:
    random, n = np.random.default_rng(5), 11
    T = csr_array(random.standard_normal((SIZE, n)) * (random.random((SIZE, n)) < 0.4))
    half = random.standard_normal((n, n)) * (random.random((n, n)) < 0.3)
    A = csr_array(half @ half.T + np.eye(n))
    mobility = factored_mobility(
        T,
        cholesky(A.data, ordering_of(A, np.arange(n))),
        0.1 * random.standard_normal((n, 2)),
        np.zeros((SIZE, 0)),
    )
    loads = random.standard_normal((3, SIZE))
    expected = [respond_reference(load, mobility.arrays) for load in loads]
    np.testing.assert_allclose(respond(loads, mobility.arrays), expected, rtol=1e-9, atol=1e-11)
