"""Open volume of cut cells: exact for planes, of second order for round bodies."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flowborne.kernels.node_distance import allow_for_curvature
from flowborne.kernels.volumes import closed_tetrahedron, open_parts

from .cut_cells import SHAPES, cut, face_shape
from .references.node_distance import allow_for_curvature_reference
from .references.volumes import closed_tetrahedron_reference, open_parts_reference

PART = st.floats(-1.0, 1.0)


def parts(distance: np.ndarray, flat: bool = False) -> np.ndarray:
    """Open parts of cells with faces that are open."""
    nx, ny, nz = (n - 1 for n in distance.shape)
    shape = (nx, ny, 1 if flat else nz)
    out = np.empty(shape)
    open_parts(out, distance, *(np.ones(face_shape(shape, axis)) for axis in range(3)))
    return out


def half_space(normal: np.ndarray, offset: float) -> float:
    """Part of the unit cube, or square, where normal . x > offset, by truncated powers."""
    n = len(normal)
    total = sum(
        (-1) ** (n + sum(corner)) * max(float(normal @ corner) - offset, 0.0) ** n
        for corner in product((0, 1), repeat=n)
    )
    return float(total / (np.prod(normal) * (2 if n == 2 else 6)))


@given(st.integers(0, 10_000))
@settings(deadline=None, max_examples=200)
def test_part_of_a_tetrahedron(seed: int) -> None:
    corners = np.random.default_rng(seed).uniform(-1.0, 1.0, 4)
    gaps = np.abs(np.subtract.outer(corners, corners)) + np.eye(4)
    expected = float(closed_tetrahedron_reference(corners))
    assert closed_tetrahedron(*corners) == pytest.approx(expected, abs=1e-14 / gaps.min() ** 2)


@pytest.mark.parametrize("inside", range(5))
def test_part_of_a_tetrahedron_with_equal_corners(inside: int) -> None:
    corners = [-1.0] * inside + [1.0] * (4 - inside)
    expected = [0.0, 1 / 8, 1 / 2, 7 / 8, 1.0][inside]
    assert closed_tetrahedron(*corners) == pytest.approx(expected, abs=1e-15)
    assert closed_tetrahedron(0.0, 0.0, 0.0, 0.0) == 0.0


@pytest.mark.parametrize("shape", SHAPES)
def test_open_parts(shape: tuple[int, int, int]) -> None:
    """Of two balls, with random closed faces; those of some cells are all closed."""
    made, random = cut(shape), np.random.default_rng(5)
    distance = made.distance + 1e-3 * random.standard_normal(made.distance.shape)
    if made.flat:
        distance[:, :, 1] = distance[:, :, 0]
    out = np.empty(shape)
    open_parts(out, distance, *made.opened)
    assert ((out > 0.0) & (out < 1.0)).any()
    assert (out == 0.0).any()
    expected = open_parts_reference(distance, *made.opened)
    np.testing.assert_allclose(out, expected, atol=1e-9)


@given(st.tuples(PART, PART, PART), st.floats(-1.5, 1.5), st.booleans())
@settings(deadline=None, max_examples=200)
def test_planes_are_exact(normal: tuple[float, float, float], offset: float, flat: bool) -> None:
    """Whatever their orientation."""
    n = np.array(normal[: 2 if flat else 3])
    n[np.abs(n) < 0.05] = 0.05
    corner = np.moveaxis(np.indices((2, 2, 3)), 0, -1)[..., : len(n)]
    found = parts(corner @ n - offset, flat)[0, 0, 0]
    assert found == pytest.approx(half_space(n, offset), abs=1e-9)


@pytest.mark.parametrize("axis", range(3))
def test_a_mirrored_body_leaves_mirrored_volumes(axis: int) -> None:
    """A body that is no plane in a cell too: flow about a wing is as that about its image."""
    distance = np.random.default_rng(3).uniform(-1.0, 1.0, (6, 6, 6))
    image = parts(np.ascontiguousarray(np.flip(distance, axis)))
    np.testing.assert_allclose(np.flip(image, axis), parts(distance), atol=1e-12)


def round_distance(cells: int, radius: float, flat: bool) -> np.ndarray:
    """Distance to a ball, or disc, in the unit cube at the nodes."""
    x = np.moveaxis(np.indices((cells + 1,) * 3), 0, -1) / cells - [0.513, 0.487, 0.496]
    if flat:
        x = x[:, :, :2] * [1.0, 1.0, 0.0]
    return np.linalg.norm(x, axis=-1) - radius


@pytest.mark.parametrize("flat", [True, False])
def test_round_bodies_have_their_volume_at_second_order(flat: bool) -> None:
    cells, radius = np.array([16, 24, 32, 48]), 0.31
    exact = np.pi * radius**2 if flat else 4.0 / 3.0 * np.pi * radius**3
    errors, curved = [], []
    for n in cells:
        distance = round_distance(n, radius, flat)
        volume = 1.0 / n**2 if flat else 1.0 / n**3
        errors.append(1.0 - volume * (1.0 - parts(distance, flat)).sum() / exact)
        allowed = allow_for_curvature(distance, 1.0 / n)
        curved.append(1.0 - volume * (1.0 - parts(allowed, flat)).sum() / exact)
    slope = -np.polyfit(np.log(cells), np.log(errors), 1)[0]
    assert abs(slope - 2.0) < 0.1, f"measured order {slope:.3f}"
    assert errors[0] < (0.01 if flat else 0.025)
    assert (np.abs(curved) < (1.01 if flat else 0.25) * np.array(errors)).all()


@pytest.mark.parametrize("shape", SHAPES)
def test_allow_for_curvature(shape: tuple[int, int, int]) -> None:
    """Of two balls: at the kinks between them the distance is left as it is, and so in a slab."""
    distance = cut(shape).distance
    found = allow_for_curvature(distance, 0.5)
    assert (found != distance).any() == (shape[2] > 1)
    np.testing.assert_allclose(found, allow_for_curvature_reference(distance, 0.5), atol=1e-15)
