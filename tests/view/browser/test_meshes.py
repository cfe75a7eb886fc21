"""Flat shapes raised to prisms."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.view.browser.meshes import counter_clockwise, prism, repeated

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


def areas(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(m, 3) outward area vectors of triangles."""
    a, b, c = vertices[faces].swapaxes(0, 1)
    return 0.5 * np.cross(b - a, c - a)


def test_area_of_a_prism_with_a_hole() -> None:
    vertices, faces = prism([2.0 * SQUARE - 0.5, SQUARE[::-1]], 0.0, 0.1)
    area = areas(vertices, faces)
    assert area[area[:, 2] > 0.0].sum(axis=0) == pytest.approx([0.0, 0.0, 3.0])
    level = np.linalg.norm(area[area[:, 2] == 0.0], axis=1)
    assert level.sum() == pytest.approx(0.1 * (8.0 + 4.0))


def test_sides_face_outward() -> None:
    vertices, faces = prism([SQUARE], 0.0, 1.0)
    area = areas(vertices, faces)
    outward = vertices[faces].mean(axis=1) - [0.5, 0.5, 0.5]
    assert ((area * outward).sum(axis=1) > 0.0).all()


def test_outline_is_turned_round_when_it_is_clockwise() -> None:
    assert np.array_equal(counter_clockwise(SQUARE[::-1]), SQUARE)


def test_equal_meshes_are_one() -> None:
    first, second = prism([SQUARE], 0.0, 1.0), prism([SQUARE + 5.0], 0.0, 1.0)
    vertices, faces = repeated(np.array([first[0], second[0]]), first[1])
    assert np.array_equal(vertices[faces[len(first[1]) :]], second[0][second[1]])


def test_meshes_that_are_added_have_no_size() -> None:
    vertices, faces = prism([SQUARE], 0.0, 1.0)
    more, added = repeated(vertices[None], faces, 3)
    assert (len(more), len(added)) == (3 * len(vertices), 3 * len(faces))
    assert np.abs(areas(more, added)[len(faces) :]).max() == 0.0
    assert np.array_equal(repeated(vertices[None], faces, 1)[0], vertices)
