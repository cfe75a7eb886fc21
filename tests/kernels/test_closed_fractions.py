"""Closed parts of faces against NumPy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flowborne.kernels.closed_fractions import (
    CREASE,
    add_closed,
    closed_fraction,
    count_beside,
    list_closed,
    share_closed,
)
from flowborne.kernels.sides import CLOSED, OPEN, PERIODIC

from .cut_cells import SHAPES, cut, face_shape
from .references.closed_fractions import (
    add_closed_reference,
    count_beside_reference,
    face_closed_reference,
    list_closed_reference,
    share_closed_reference,
)

AXES = [(shape, axis) for shape in SHAPES for axis in range(3 if shape[2] > 1 else 2)]
DISTANCE = st.one_of(st.just(0.0), st.floats(-2.0, 2.0, allow_subnormal=False))


@given(st.tuples(DISTANCE, DISTANCE, DISTANCE, DISTANCE))
@settings(deadline=None)
def test_part_of_a_square(corners: tuple[float, float, float, float]) -> None:
    a, b, c, d = corners
    expected = face_closed_reference(np.array([[[a, d], [b, c]]]), 0)[0, 0, 0]
    assert closed_fraction(a, b, c, d) == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize(("shape", "axis"), AXES)
def test_add_closed(shape: tuple[int, int, int], axis: int) -> None:
    made = cut(shape)
    total = np.random.default_rng(1).random(face_shape(shape, axis))
    expected = add_closed_reference(total, made.phi, made.box, axis)
    assert (expected - total).max() > 0.5
    add_closed(total, made.phi, made.box, axis)
    np.testing.assert_allclose(total, expected, atol=1e-14)


@pytest.mark.parametrize("shape", SHAPES)
def test_count_beside(shape: tuple[int, int, int]) -> None:
    made, beside = cut(shape), np.random.default_rng(2).integers(0, 2, shape)
    expected = count_beside_reference(beside, made.phi, made.box, 2)
    assert expected.max() == 3
    count_beside(beside, made.phi, made.box, 2)
    np.testing.assert_array_equal(beside, expected)


@pytest.mark.parametrize(("shape", "axis"), AXES)
@pytest.mark.parametrize(
    "sides", [(OPEN, OPEN), (CLOSED, OPEN), (OPEN, CLOSED), (PERIODIC, PERIODIC)]
)
def test_shares_and_their_list(
    shape: tuple[int, int, int], axis: int, sides: tuple[int, int]
) -> None:
    """Some faces in a crease and just below its limit."""
    made, codes, random = cut(shape), np.array(sides), np.random.default_rng(3)
    beside = random.integers(0, 3, shape)
    total = add_closed_reference(np.zeros(face_shape(shape, axis)), made.phi, made.box, axis)
    total *= random.uniform(1.0, 2.0, total.shape)
    opened = np.ones(total.shape)
    union = face_closed_reference(made.distance, axis)
    assert ((union > 1.0 - 10.0 * CREASE) & (union < 1.0)).any()
    parts = opened, total, made.distance, beside, made.phi, made.box, axis, codes
    expected, opening = share_closed_reference(*parts)
    share = np.empty(expected.shape)
    count = share_closed(share, *parts)
    np.testing.assert_allclose(share, expected, atol=1e-14)
    np.testing.assert_allclose(opened, opening, atol=1e-14)
    assert count == (expected > 0.0).sum()
    counts = np.array(total.shape)
    faces, closed = list_closed_reference(share, made.box, counts)
    found = [np.full(count + 3, -1) for _ in range(3)]
    parts_of = np.full(count + 3, -1.0)
    assert list_closed(share, made.box, axis, 7, counts, 2, *found, parts_of) == count + 2
    inner = slice(2, count + 2)
    np.testing.assert_array_equal(found[0][inner], axis)
    np.testing.assert_array_equal(found[1][inner], faces)
    np.testing.assert_array_equal(found[2][inner], 7)
    np.testing.assert_array_equal(parts_of[inner], closed)
    assert (np.delete(parts_of, inner) == -1.0).all()
