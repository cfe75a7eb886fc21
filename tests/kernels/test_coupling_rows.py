"""Rows of cells beside bodies and flesh, and the velocity of closed parts, against NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.kernels.arrays import FREE, PRESCRIBED
from flowborne.kernels.coupling_rows import (
    COVERED,
    ENCLOSED,
    NARROW,
    WIDE,
    ClosedParts,
    add_body_velocity,
    fastest_closed,
    fill_empty_faces,
    flesh_rows,
    kinds_of_cells,
    list_cells,
)

from .cut_cells import ORIGIN, SHAPES, H, cut, face_shape
from .references.body_velocity import body_velocity_reference
from .references.coupling_rows import (
    flesh_rows_reference,
    kinds_of_cells_reference,
    list_cells_reference,
)

NORMAL = [
    np.full((3, 2), FREE),
    np.array([[PRESCRIBED, FREE], [FREE, PRESCRIBED], [PRESCRIBED, PRESCRIBED]]),
]


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("normal", NORMAL)
def test_kinds_of_cells(shape: tuple[int, int, int], normal: np.ndarray) -> None:
    random = np.random.default_rng(3)
    opened = [random.random(face_shape(shape, d)) for d in range(3)]
    for fraction in opened:
        fraction[random.random(fraction.shape) < 0.7] = 0.0
    expected = kinds_of_cells_reference(tuple(opened), normal)
    kinds = {COVERED, NARROW, WIDE} | ({ENCLOSED} if (normal == PRESCRIBED).any() else set())
    assert set(np.unique(expected)) == kinds
    whole = np.array([[[0, n + 1] for n in shape]])
    np.testing.assert_array_equal(kinds_of_cells(*opened, normal, whole), expected)
    outside = kinds_of_cells(*opened, normal, whole - [[[0, 1], [0, 0], [0, 0]]])[-1]
    assert (outside == WIDE).all()


@pytest.mark.parametrize("shape", SHAPES)
def test_list_cells(shape: tuple[int, int, int]) -> None:
    made, random = cut(shape), np.random.default_rng(4)
    inside = made.box[:, 1] - made.box[:, 0] - 1
    share = tuple(random.random(inside + (np.arange(3) == d)) for d in range(3))
    for values in share:
        values[random.random(values.shape) < 0.7] = 0.0
    centre = tuple(random.uniform(-0.5, 0.5, (2, *values.shape)) for values in share)
    for values in centre if made.flat else ():
        values[1] = 0.0
    piece = made.piece(share[0], centre[0])._replace(share=share, centre=centre)
    listed = random.random(shape) < 0.5
    expected, found = list_cells_reference(piece, listed), list_cells(piece, listed)
    assert 0 < found[0].size == expected[0].size < inside.prod()
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-14)


def parts(shape: tuple[int, int, int], count: int = 40) -> tuple[np.ndarray, np.ndarray]:
    """(n,) axes and (n, 3) indices of random faces."""
    random = np.random.default_rng(5)
    axis = random.integers(0, 3 if shape[2] > 1 else 2, count)
    sizes = np.array([face_shape(shape, d) for d in axis])
    return axis, (random.random((count, 3)) * sizes).astype(np.int64)


@pytest.mark.parametrize("shape", SHAPES)
def test_flesh_rows(shape: tuple[int, int, int]) -> None:
    random = np.random.default_rng(6)
    axis, at = parts(shape)
    corner, weight = random.integers(0, 9, (axis.size, 3)), random.random((axis.size, 3))
    given = axis, at, random.random(axis.size), corner, weight, 12, 0.3
    listed = random.random(shape) < 0.5
    part, found = flesh_rows(*given, listed)
    expected_part, expected = flesh_rows_reference(*given, listed)
    assert 0 < part.size < 2 * axis.size
    for one, other in zip((part, *found), (expected_part, *expected), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-14)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("skin", [0, 15])
def test_body_velocity(shape: tuple[int, int, int], skin: int) -> None:
    random, flat = np.random.default_rng(7), shape[2] == 1
    axis, at = parts(shape)
    place = ORIGIN + H * (at + 0.5 * (np.arange(3) != axis[:, None]))
    if flat:
        place[:, 2] = 0.0
    body, closed = random.integers(0, 3, axis.size), random.random(axis.size)
    corner, weight = random.integers(0, 9, (skin, 3)), random.random((skin, 3))
    twist, flesh = random.standard_normal((3, 6)), random.standard_normal((9, 3))
    moved = body_velocity_reference(place, axis, body, corner, weight, twist, flesh)
    for d in range(2 if flat else 3):
        out = random.random(face_shape(shape, d))
        expected, own = out.copy(), axis == d
        np.add.at(expected, tuple(at[own].T), (closed * moved)[own])
        face = np.where(own, np.ravel_multi_index(tuple(at.T), out.shape, mode="clip"), 0)
        listed = ClosedParts(axis, face, body, closed, place, corner, weight)
        add_body_velocity(out, d, listed, (twist, flesh))
        np.testing.assert_allclose(out, expected, atol=1e-13)
        u, opened, held = (random.standard_normal(out.shape) for _ in range(3))
        held[random.random(out.shape) < 0.5] = 0.0
        met = opened * u
        add_body_velocity(met, d, listed, (twist, flesh))
        faces = np.unique(face[own])
        found = fastest_closed(u, d, opened, listed, (twist, flesh))
        assert found == np.abs(met.flat[faces]).max()
        expected, empty = u.copy(), faces[held.flat[faces] == 0.0]
        expected.flat[empty] = met.flat[empty]
        fill_empty_faces(faces, u, d, held, opened, listed, (twist, flesh))
        np.testing.assert_array_equal(u, expected)
