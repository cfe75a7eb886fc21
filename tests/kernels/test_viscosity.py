"""The viscous system of one component against NumPy."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from flowborne.fluid.viscosity import kinds_of_faces
from flowborne.kernels.arrays import FREE, PERIODIC, PRESCRIBED
from flowborne.kernels.edge_crossings import new_crossings
from flowborne.kernels.viscosity import (
    GIVEN,
    INACTIVE,
    RUN,
    UNKNOWN,
    CutFaces,
    apply_component,
    face_distances,
    find_centres,
    link_faces,
    meet_walls,
)

from .cut_cells import SHAPES, cut, face_shape
from .references.viscosity import (
    face_distances_reference,
    find_centres_reference,
    link_faces_reference,
    meet_walls_reference,
)
from .references.viscous_operator import apply_component_reference

CODES = [
    np.full((3, 2), PRESCRIBED),
    np.array([[PERIODIC, PERIODIC], [FREE, PRESCRIBED], [PERIODIC, PERIODIC]]),
    np.array([[FREE, FREE], [PERIODIC, PERIODIC], [PRESCRIBED, FREE]]),
]
CASES = [
    (shape, normal, axis)
    for shape, normal in itertools.product(SHAPES, CODES)
    for axis in range(3 if shape[2] > 1 else 2)
]


def kinds(shape: tuple[int, int, int], normal: np.ndarray, axis: int) -> tuple:
    """The cut grid, centres, open parts of the cells and kinds; some open faces inside are
    prescribed."""
    made = cut(shape)
    kind = kinds_of_faces(made.opened[axis], axis, normal)
    random = np.random.default_rng(1)
    kind[(kind == UNKNOWN) & (random.random(kind.shape) < 0.1)] = GIVEN
    parts = random.random(shape) * (random.random(shape) < 0.9)
    return made, find_centres_reference(made.distance, axis), parts, kind


@pytest.mark.parametrize(("shape", "normal", "axis"), CASES)
def test_distances_and_kinds(shape: tuple, normal: np.ndarray, axis: int) -> None:
    made = cut(shape)
    phi = np.empty(face_shape(shape, axis))
    face_distances(made.distance, axis, 0.5, phi)
    expected = face_distances_reference(made.distance, axis) - 0.5
    np.testing.assert_allclose(phi, expected, atol=1e-15)
    opened = np.moveaxis(made.opened[axis], axis, 0)
    kind = np.moveaxis(kinds_of_faces(made.opened[axis], axis, normal), axis, 0)
    given = {PRESCRIBED: GIVEN, FREE: UNKNOWN, PERIODIC: UNKNOWN}
    expected = np.where(opened > 0.0, UNKNOWN, INACTIVE)
    expected[0] = np.where(opened[0] > 0.0, given[normal[axis, 0]], INACTIVE)
    last = INACTIVE if normal[axis, 1] == PERIODIC else given[normal[axis, 1]]
    expected[-1] = np.where(opened[-1] > 0.0, last, INACTIVE)
    np.testing.assert_array_equal(kind, expected)


@pytest.mark.parametrize(("shape", "normal", "axis"), CASES)
def test_centres(shape: tuple, normal: np.ndarray, axis: int) -> None:
    made = cut(shape)
    centre = np.zeros((2, *face_shape(shape, axis)))
    near = np.arange(centre[0].size)
    find_centres(made.distance, made.crossings, axis, near, centre, made.flat)
    expected = find_centres_reference(made.distance, axis)
    assert expected.any()
    np.testing.assert_allclose(centre, expected, atol=1e-10)


@pytest.mark.parametrize(("shape", "normal", "axis"), CASES)
def test_links(shape: tuple, normal: np.ndarray, axis: int) -> None:
    made, centre, parts, kind = kinds(shape, normal, axis)
    velocity = np.random.default_rng(2).standard_normal(kind.shape)
    for d in range(2 if made.flat else 3):
        periodic = bool(normal[d, 0] == PERIODIC)
        grid = made.distance, made.opened[axis], centre, parts
        edges = made.distance, made.crossings
        found = [np.zeros(kind.shape) for _ in range(3)]
        near, faces = np.full(kind.shape, -1.0), CutFaces(axis, kind, *edges, *grid[1:], 0.7)
        link_faces(faces, d, near, velocity, *found, periodic)
        expected = link_faces_reference(axis, d, kind, *grid, velocity, 0.7, periodic)
        for one, other in zip(found, expected, strict=True):
            assert other.any()
            np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-14)


def test_links_of_uncut_faces_need_no_geometry() -> None:
    shape, nothing = (5, 4, 3), np.full((6, 5, 4), np.nan)
    kind, away = np.full((6, 4, 3), UNKNOWN, np.uint8), np.full((6, 4, 3), 0.1)
    edges = nothing, new_crossings(nothing, 1e-9, False)
    cuts = nothing, np.full((2, 6, 4, 3), np.nan), np.full(shape, np.nan)
    for d in range(3):
        diagonal, link, given = (np.zeros(kind.shape) for _ in range(3))
        faces = CutFaces(0, kind, *edges, *cuts, 0.7)
        link_faces(faces, d, away, away, diagonal, link, given, False)
        assert set(np.unique(link)) == {0.0, 0.7}
        np.testing.assert_array_equal(np.moveaxis(link, d, 0)[:-1], 0.7)


LONG = [(3, 5, 2 * RUN + 7), (RUN + 9, 2, RUN + 1), (RUN + 9, 2 * RUN, 1)]
"""Shapes of faces with runs that are whole, cut short and one face long."""


@pytest.mark.parametrize("shape", LONG)
@pytest.mark.parametrize("periodic", [False, True])
def test_links_far_from_bodies_are_alike_on_any_number_of_threads(
    shape: tuple, periodic: bool
) -> None:
    """But where a velocity is given, here and there."""
    random, away = np.random.default_rng(4), np.ones(shape)
    kind = random.choice([INACTIVE, UNKNOWN, GIVEN], shape, p=[0.01, 0.985, 0.005]).astype(np.uint8)
    nothing, velocity = np.full([n + 1 for n in shape], np.nan), random.standard_normal(shape)
    edges = nothing, new_crossings(nothing, 1e-9, False)
    cuts = np.full(shape, np.nan), np.full((2, *shape), np.nan), np.full(shape, np.nan)
    axis = 0
    for d in range(2 if shape[2] == 1 else 3):
        count = shape[d] - int(periodic and d == axis)
        k, u = (np.moveaxis(values, d, 0)[:count] for values in (kind, velocity))
        ahead, pushed = np.roll(k, -1, axis=0), np.roll(u, -1, axis=0)
        joined = (np.arange(count) < count - 1 + int(periodic)).reshape(-1, 1, 1)
        linked = joined & (k == UNKNOWN) & (ahead == UNKNOWN)
        here = joined & (k == UNKNOWN) & (ahead == GIVEN)
        there = joined & (k == GIVEN) & (ahead == UNKNOWN)
        expected = np.zeros((3, *np.moveaxis(kind, d, 0).shape))
        expected[0, :count] = linked | here
        expected[0, :count] += np.roll(linked | there, 1, axis=0)
        expected[1, :count] = linked
        expected[2, :count] = here * pushed + np.roll(there * u, 1, axis=0)
        for kernel in (link_faces, link_faces.parallel):
            found = [np.zeros(shape) for _ in range(3)]
            faces = CutFaces(axis, kind, *edges, *cuts, 0.7)
            kernel(faces, d, away, velocity, *found, periodic)
            for one, other in zip(found, expected, strict=True):
                assert other.any()
                np.testing.assert_allclose(np.moveaxis(one, d, 0), 0.7 * other, atol=1e-14)


@pytest.mark.parametrize(("shape", "normal", "axis"), CASES)
def test_walls(shape: tuple, normal: np.ndarray, axis: int) -> None:
    made, centre, parts, kind = kinds(shape, normal, axis)
    beside = np.flatnonzero(kind == UNKNOWN)
    grid = made.distance, made.opened[axis], centre, parts
    faces = CutFaces(axis, kind, made.distance, made.crossings, *grid[1:], 0.7)
    wall, gap, place, node = meet_walls(faces, normal, beside)
    expected = meet_walls_reference(axis, kind, *grid, 0.7, normal, beside)
    assert (np.abs(wall) > 0.0).any(axis=0).all()
    np.testing.assert_allclose(wall, expected[0], rtol=1e-9, atol=1e-13)
    np.testing.assert_allclose(gap, expected[1], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(place, expected[2], rtol=1e-9, atol=1e-12)
    there = wall != 0.0
    np.testing.assert_array_equal(node[there], expected[3][there])


@pytest.mark.parametrize(("shape", "normal", "axis"), CASES)
def test_apply_component(shape: tuple, normal: np.ndarray, axis: int) -> None:
    """No links beyond the domain, and none from a face that stands twice."""
    random, size = np.random.default_rng(3), face_shape(shape, axis)
    links, wraps = random.random((3, *size)), np.zeros(3, np.int64)
    for d in range(3):
        along = np.moveaxis(links[d], d, 0)
        if normal[d, 0] == PERIODIC:
            wraps[d] = shape[d]
            along[shape[d] :] = 0.0
        else:
            along[-1] = 0.0
        if normal[axis, 0] == PERIODIC:
            np.moveaxis(links[d], axis, 0)[-1] = 0.0
    x, scale = random.standard_normal(links[0].size), random.random(links[0].size)
    out = np.empty_like(x)
    apply_component(out, x, scale, links, wraps)
    expected = apply_component_reference(x, scale, links, wraps)
    np.testing.assert_allclose(out, expected, atol=1e-13)
