"""Steps and sums of padded vectors against NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.kernels import jit
from flowborne.kernels.jit import kernel_threads
from flowborne.kernels.vectors import descend, dot, load_cells, scaled, turn

from .padded import cells_of

SHAPES = [(6, 7, 8), (1, 9, 7)]


def fields(shape: tuple[int, int, int], count: int) -> np.ndarray:
    return np.random.default_rng(0).standard_normal((count, *shape))


@pytest.mark.parametrize("shape", SHAPES)
def test_sums_and_steps(shape: tuple[int, int, int]) -> None:
    x, r, p, q = fields(shape, 4)
    assert dot(x, r) == pytest.approx(np.vdot(x, r))
    after = x + 0.3 * p, r - 0.3 * q, q + 0.7 * p
    assert descend(x, r, p, q, 0.3) == pytest.approx(np.vdot(after[1], after[1]))
    turn(p, q, 0.7)
    for found, expected in zip((x, r, p), after, strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-15)
    left = r - q
    assert descend(None, r, None, q, 1.0) == pytest.approx(np.vdot(left, left))
    np.testing.assert_array_equal(r, left)


@pytest.mark.parametrize("shape", SHAPES)
def test_copies(shape: tuple[int, int, int]) -> None:
    source, left = fields(shape, 2)
    target = np.empty(shape, np.float32)
    scaled(source, target, 0.3)
    np.testing.assert_array_equal(target, (0.3 * source).astype(np.float32))
    inside, diagonal = cells_of(left), np.maximum(source, 0.0)
    expected = np.zeros(shape)
    expected[inside] = np.where(diagonal[inside] > 0.0, left[inside], 0.0)
    load_cells(target := np.ones(shape), np.ascontiguousarray(left[inside]), diagonal)
    np.testing.assert_array_equal(target, expected)


@pytest.mark.parametrize("threads", [2, 3])
def test_sums_have_the_same_bits_on_any_number_of_threads(
    threads: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The bench `threads` compares the bits of a whole step, which takes minutes to compile."""
    monkeypatch.setattr(jit, "cores", lambda: threads)
    x, r, p, q = fields((40, 52, 53), 4)
    assert x.size >= jit.LARGE
    b = np.zeros(x.shape, np.float32)

    def sums() -> tuple[float, ...]:
        at, left, direction = x.copy(), r.copy(), p.copy()
        turn(direction, q, 0.7)
        after = descend(at, left, direction, q, 0.3, b, 2.0)
        first = dot(at, left), dot(b, left, 0.5), after
        return *first, descend(None, left, None, q, 1.0)

    expected = sums()
    with kernel_threads(threads):
        assert sums() == expected
