"""Open parts of edges and faces against NumPy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flowborne.kernels.closed_fractions import closed_fraction
from flowborne.kernels.open_faces import open_edge, open_polygon

from .references.open_faces import open_edge_reference, open_polygon_reference

DISTANCE = st.one_of(st.just(0.0), st.floats(-2.0, 2.0, allow_subnormal=False))


@given(DISTANCE, DISTANCE)
@settings(deadline=None)
def test_part_of_an_edge(a: float, b: float) -> None:
    expected = open_edge_reference(np.array([a]), np.array([b]))[0]
    assert open_edge(a, b) == pytest.approx(expected, abs=1e-14)


@given(st.tuples(DISTANCE, DISTANCE, DISTANCE, DISTANCE))
@settings(deadline=None)
def test_part_of_a_square_and_its_centre(corners: tuple[float, float, float, float]) -> None:
    area, x, y = open_polygon(*corners)
    expected = open_polygon_reference(np.array(corners))
    assert area == pytest.approx(float(expected[0]), abs=1e-14)
    if area > 1e-3:
        assert (x, y) == pytest.approx((float(expected[1]), float(expected[2])), abs=1e-10)
    opposite = (corners[0] < 0.0) == (corners[2] < 0.0) != (corners[1] < 0.0)
    if not (opposite and (corners[1] < 0.0) == (corners[3] < 0.0)):
        assert area == pytest.approx(1.0 - closed_fraction(*corners), abs=1e-14)


def test_centre_of_a_triangle() -> None:
    assert open_polygon(1.0, -1.0, -3.0, -1.0) == pytest.approx((0.125, -1.0 / 3.0, -1.0 / 3.0))
