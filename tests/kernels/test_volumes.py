"""Open volume of cut cells: exact for planes and edges, right for what is round."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flowborne.kernels.arrays import Array
from flowborne.kernels.closed_fractions import open_cells
from flowborne.kernels.cut_faces import closed_face
from flowborne.kernels.edge_crossings import Crossings, new_crossings

from .cut_cells import face_shape

PART = st.floats(-1.0, 1.0)


def parts(distance: Array, found: Crossings, flat: bool = False) -> Array:
    """Open parts of cells, and with them of their faces."""
    nx, ny, nz = (n - 1 for n in distance.shape)
    shape = (nx, ny, 1 if flat else nz)
    faces = [np.ones(face_shape(shape, axis)) for axis in range(3)]
    for axis in range(2 if flat else 3):
        for at in np.ndindex(faces[axis].shape):
            faces[axis][at] -= closed_face(distance, found, axis, *at, flat, False)[0]
    out = np.empty(shape)
    box = np.array([[[0, n] for n in distance.shape]])
    open_cells(out, 1.0, distance, found, tuple(faces), box)
    return out


def half_space(normal: Array, offset: float) -> float:
    """Part of the unit cube, or square, where normal . x > offset, by truncated powers."""
    n = len(normal)
    total = sum(
        (-1) ** (n + sum(corner)) * max(float(normal @ corner) - offset, 0.0) ** n
        for corner in product((0, 1), repeat=n)
    )
    return float(total / (np.prod(normal) * (2 if n == 2 else 6)))


@given(st.tuples(PART, PART, PART), st.floats(-1.5, 1.5), st.booleans())
@settings(deadline=None, max_examples=200)
def test_planes_are_exact(normal: tuple[float, float, float], offset: float, flat: bool) -> None:
    """Whatever their orientation."""
    n = np.array(normal[: 2 if flat else 3])
    n[np.abs(n) < 0.05] = 0.05
    corner = np.moveaxis(np.indices((2, 2, 3)), 0, -1)[..., : len(n)]
    distance = corner @ n - offset
    found = parts(distance, new_crossings(distance, 1e-9, flat), flat)[0, 0, 0]
    assert found == pytest.approx(half_space(n, offset), abs=1e-9)


def wedge(point: Array, first: Array, second: Array) -> tuple[Array, Crossings]:
    """Distances at the nodes of two cells to the body behind two planes through a point, and where
    edges cross it."""
    nodes = np.moveaxis(np.indices((2, 2, 3)), 0, -1)
    away = np.stack([(nodes - point) @ n for n in (first, second)])
    phi = away.max(axis=0)
    found, used = new_crossings(phi, 1e-9, False), 0
    for d in range(3):
        for node in np.ndindex(2, 2, 3):
            if node[d] + 1 == phi.shape[d]:
                continue
            ends = node, tuple(np.add(node, np.eye(3, dtype=int)[d]))
            a, b = phi[ends[0]], phi[ends[1]]
            if (a < 0.0) == (b < 0.0):
                continue
            outer, inner = ends if a >= 0.0 else ends[::-1]
            each = [v[outer] / (v[outer] - v[inner]) if v[outer] >= 0.0 else -1.0 for v in away]
            side = int(np.argmax(each))
            found.at[(d, *node)] = used
            found.part[used], found.piece[used] = each[side], side
            found.normal[used] = (first, second)[side]
            used += 1
    return phi, found


@given(st.integers(0, 10_000))
@settings(deadline=None, max_examples=100)
def test_an_edge_through_a_cell_is_exact(seed: int) -> None:
    """A right angle along z, and turned a little, against cubes of a thirtieth of the cell."""
    random = np.random.default_rng(seed)
    turn, point = random.uniform(0.0, 2.0 * np.pi), random.uniform(0.1, 0.9, 3)
    lean = random.uniform(-0.2, 0.2, 2)
    first = np.array([np.cos(turn), np.sin(turn), lean[0]])
    second = np.array([-np.sin(turn), np.cos(turn), lean[1]])
    first, second = first / np.linalg.norm(first), second / np.linalg.norm(second)
    phi, found = wedge(point, first, second)
    kinks = [closed_face(phi, found, 2, 0, 0, side, False, False)[3] for side in (0, 1)]
    if kinks != [1, 1] or any(
        closed_face(phi, found, axis, *(side * np.eye(3, dtype=int)[axis]), False, False)[3]
        for axis in (0, 1)
        for side in (0, 1)
    ):
        return  # the edge leaves through another face
    fine = (np.indices((30, 30, 30)).reshape(3, -1).T + 0.5) / 30.0
    outside = np.maximum((fine - point) @ first, (fine - point) @ second) >= 0.0
    assert parts(phi, found)[0, 0, 0] == pytest.approx(outside.mean(), abs=6e-3)


@pytest.mark.parametrize("axis", range(3))
def test_a_mirrored_body_leaves_mirrored_volumes(axis: int) -> None:
    """A body that is no plane in a cell too: flow about a wing is as that about its image."""
    distance = np.random.default_rng(3).uniform(-1.0, 1.0, (6, 6, 6))
    image = np.ascontiguousarray(np.flip(distance, axis))
    mirrored = parts(image, new_crossings(image, 1e-9, False))
    found = parts(distance, new_crossings(distance, 1e-9, False))
    np.testing.assert_allclose(np.flip(mirrored, axis), found, atol=1e-12)


def test_cells_without_an_open_face_hold_nothing() -> None:
    shape = (2, 2, 2)
    distance = np.ones((3, 3, 3))
    faces = [np.ones(face_shape(shape, axis)) for axis in range(3)]
    for axis in range(3):
        faces[axis][(0, 0, 0)] = faces[axis][tuple(np.eye(3, dtype=int)[axis])] = 0.0
    out = np.empty(shape)
    box, found = np.array([[[0, 3]] * 3]), new_crossings(distance, 1e-9, False)
    open_cells(out, 1.0, distance, found, tuple(faces), box)
    assert out[0, 0, 0] == 0.0
    assert out.sum() == 7.0
