"""Closed parts of faces against NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.kernels.arrays import FREE, PERIODIC, PRESCRIBED
from flowborne.kernels.closed_fractions import CREASE, close_faces, count_beside, share_closed

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
    own, centre = np.empty(expected.shape), np.zeros((2, *expected.shape))
    close_faces(made.piece(own, centre), total, axis)
    np.testing.assert_allclose(own, expected, atol=1e-14)
    cut_through = (expected > 0.0) & (expected < 1.0)
    assert not centre[:, ~cut_through].any()
    assert np.abs(centre[:, cut_through]).max() < 0.5
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
    "sides", [(FREE, FREE), (PRESCRIBED, FREE), (FREE, PRESCRIBED), (PERIODIC, PERIODIC)]
)
def test_shares_and_their_list(
    shape: tuple[int, int, int], axis: int, sides: tuple[int, int]
) -> None:
    """Some faces in a crease and just below its limit."""
    made, ends, random = cut(shape), np.array(sides), np.random.default_rng(3)
    beside = random.integers(0, 3, shape)
    share = face_closed_reference(made.phi, axis)
    centre = random.uniform(-0.5, 0.5, (2, *share.shape))
    own_centre, alone = centre.copy(), share.copy()
    total = np.zeros(face_shape(shape, axis))
    total[faces_in(made.box, axis)] = share
    total *= np.maximum(random.uniform(0.0, 2.0, total.shape), 1.0)
    opened = np.ones(total.shape)
    union = face_closed_reference(made.distance, axis)
    assert ((union > 1.0 - 10.0 * CREASE) & (union < 1.0)).any()
    piece, faces = made.piece(share, centre), (opened, total, made.distance)
    expected, opening = share_closed_reference(share, *faces, beside, made.box, axis, ends)
    found = share_closed(piece, *faces, made.crossings, beside, axis, ends)
    np.testing.assert_allclose(share, expected, atol=1e-14)
    np.testing.assert_allclose(opened, opening, atol=1e-14)
    assert len(found[0]) == (expected > 0.0).sum()
    at = faces_in(made.box, axis)
    shut = (alone > 0.0) & (opening[at] == 0.0)
    assert not centre[:, shut].any()
    single = ~shut & (alone == total[at])
    np.testing.assert_array_equal(centre[:, single], own_centre[:, single])
    both, middle = np.zeros(total.shape), np.zeros((2, *total.shape))
    everywhere = np.array([[0, n] for n in made.distance.shape])
    whole = {"box": everywhere, "distance": made.distance, "crossings": made.crossings}
    close_faces(made.piece(both, middle)._replace(**whole), total.copy(), axis)
    several = ~shut & (alone > 0.0) & (alone != total[at])
    np.testing.assert_array_equal(centre[:, several], middle[:, *at][:, several])
    assert single.any()
    assert several.any()
    assert shut.any()
    listed = list_closed_reference(share, centre, made.box, np.array(total.shape))
    for one, other in zip(found, listed, strict=True):
        np.testing.assert_array_equal(one, other)
