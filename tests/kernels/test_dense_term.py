"""A term of few dense vectors against NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.kernels.conjugate_gradients import LANES, add_term


@pytest.mark.parametrize("count", [0, 1, LANES, 3 * LANES + 2])
def test_add_term(count: int) -> None:
    """Some cells are there twice."""
    rng = np.random.default_rng(count)
    p, out = rng.normal(size=(4, 5, 6)), rng.normal(size=(4, 5, 6))
    cells, vectors = rng.integers(0, 40, count), rng.normal(size=(3, count))
    strengths, expected = np.array([1.0, -0.5, 2.0]), out.copy()
    load = vectors @ p.reshape(-1)[cells]
    np.add.at(expected.reshape(-1), cells, (strengths * load) @ vectors)
    energy = add_term(out, p, cells, vectors, strengths)
    assert energy == pytest.approx(load @ (strengths * load), rel=1e-12, abs=1e-14)
    np.testing.assert_allclose(out, expected, atol=1e-13)
