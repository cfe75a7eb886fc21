"""What comes into cells from within, on the faces of a component, against NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.kernels.carry import share_at_faces

from .references.inlets import share_reference


@pytest.mark.parametrize("shape", [(5, 4, 6), (5, 6, 1)])
@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("ring", [False, True])
def test_share_at_faces(shape: tuple[int, int, int], axis: int, ring: bool) -> None:
    random = np.random.default_rng(axis)
    cells = np.flatnonzero(random.random(shape) < 0.4)
    values = random.random(cells.size), random.random(cells.size)
    given = cells, values, axis, shape, shape[axis] * ring
    for found, wanted in zip(share_at_faces(*given), share_reference(*given), strict=True):
        np.testing.assert_allclose(found, wanted, rtol=1e-15)
