"""Where cells of the levels lie from each other, against the edges of the cells."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from flowborne.solvers.hierarchy import distance_ratio, interpolation_weights, widths

from ..kernels.references.centres import distance_ratio_reference, interpolation_weights_reference

LENGTHS = list(itertools.product((5, 8, 13, 16), (1, 2, 4), (1, 2), (False, True)))
"""Finest cells, how many of them in a fine cell, factor of coarsening, whether periodic."""


@pytest.mark.parametrize(("cells", "size", "factor", "periodic"), LENGTHS)
def test_distances_between_centres(cells: int, size: int, factor: int, periodic: bool) -> None:
    fine, coarse = widths(cells, size, periodic), widths(cells, size * factor, periodic)
    found = distance_ratio(fine, coarse)
    expected = [
        distance_ratio_reference(face, factor, size, cells, periodic) for face in range(found.size)
    ]
    np.testing.assert_allclose(found, expected)
    n = fine.size - 2
    np.testing.assert_allclose(
        interpolation_weights(fine, coarse, periodic),
        interpolation_weights_reference(n, factor, size, cells, periodic),
        atol=1e-14,
    )
