"""Closed parts of faces against NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.kernels.arrays import CLOSED, OPEN, PERIODIC
from flowborne.kernels.closed_fractions import (
    CREASE,
    close_faces,
    count_beside,
    list_closed,
    share_closed,
)

from .cut_cells import SHAPES, cut, face_shape
from .references.closed_fractions import (
    count_beside_reference,
    face_closed_reference,
    faces_in,
    list_closed_reference,
    share_closed_reference,
)

AXES = [(shape, axis) for shape in SHAPES for axis in range(3 if shape[2] > 1 else 2)]


@pytest.mark.parametrize(("shape", "axis"), AXES)
def test_close_faces(shape: tuple[int, int, int], axis: int) -> None:
    made = cut(shape)
    before = np.random.default_rng(1).random(face_shape(shape, axis))
    expected, total = face_closed_reference(made.phi, axis), before.copy()
    assert expected.max() > 0.5
    own = np.empty(expected.shape)
    close_faces(own, total, made.phi, made.own_crossings, made.box, axis, made.flat)
    np.testing.assert_allclose(own, expected, atol=1e-14)
    before[faces_in(made.box, axis)] += own
    np.testing.assert_allclose(total, before, atol=1e-14)


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
    share = face_closed_reference(made.phi, axis)
    total = np.zeros(face_shape(shape, axis))
    total[faces_in(made.box, axis)] = share
    total *= np.maximum(random.uniform(0.0, 2.0, total.shape), 1.0)
    opened = np.ones(total.shape)
    union = face_closed_reference(made.distance, axis)
    assert ((union > 1.0 - 10.0 * CREASE) & (union < 1.0)).any()
    parts = share, opened, total, made.distance
    rest = beside, made.box, axis, codes
    expected, opening = share_closed_reference(*parts, *rest)
    count = share_closed(*parts, made.crossings, *rest, made.flat)
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
