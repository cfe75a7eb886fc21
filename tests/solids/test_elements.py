"""Quadratic simplices: their parts, masses and shape functions."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.kernels.arrays import Array, Integers
from flowborne.solids.elements import (
    corners,
    lumped,
    measures,
    oriented,
    parts,
    shape_gradients,
    with_middles,
)
from flowborne_validation.flesh_bars import bar_mesh, flat_mesh

MESHES = {"room": bar_mesh((3, 2, 2), (0.3, 0.1, 0.2)), "slab": flat_mesh((3, 2), (0.3, 0.1))}
WHOLE = {"room": 0.3 * 0.1 * 0.2, "slab": 0.3 * 0.1}


def quadratic(kind: str) -> tuple[Array, Integers]:
    points, simplices = MESHES[kind]
    edges, elements = with_middles(len(points), simplices)
    return np.concatenate([points, points[edges].mean(axis=1)]), elements


@pytest.mark.parametrize("kind", MESHES)
def test_parts_fill_the_element_with_its_orientation(kind: str) -> None:
    nodes, elements = quadratic(kind)
    small = measures(nodes, parts(elements))
    whole = np.repeat(measures(nodes, corners(elements)), small.size // len(elements))
    np.testing.assert_allclose(small, whole * len(elements) / small.size, rtol=1e-12)
    assert len(np.unique(nodes.round(9), axis=0)) == len(nodes)


@pytest.mark.parametrize("kind", MESHES)
def test_mass_and_its_centre(kind: str) -> None:
    nodes, elements = quadratic(kind)
    volume = lumped(nodes, elements)
    assert volume.min() > 0.0
    assert volume.sum() == pytest.approx(WHOLE[kind], rel=1e-12)
    np.testing.assert_allclose(volume @ nodes / volume.sum(), [0.15, 0.0, 0.0], atol=1e-12)


@pytest.mark.parametrize("kind", MESHES)
def test_gradients_are_exact_for_quadratic_fields(kind: str) -> None:
    """Their integral over the mesh is that of the field over its sides."""
    nodes, elements = quadratic(kind)
    gradients, volume = shape_gradients(nodes, elements)
    points = gradients.shape[1] - 1
    mean = gradients[:, :points].mean(axis=1)
    np.testing.assert_allclose(gradients[:, points], mean, atol=1e-12 * np.abs(mean).max())
    x, y, _ = nodes.T
    field = 1.0 + 2.0 * x + 3.0 * x * y + 5.0 * x**2
    found = np.einsum("mkj,mk,m->j", mean, field[elements], volume)
    across = WHOLE[kind] * (2.0 + 10.0 * 0.15), WHOLE[kind] * 3.0 * 0.15
    np.testing.assert_allclose(found, [*across, 0.0], rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("kind", MESHES)
def test_elements_the_wrong_way_round_are_turned(kind: str) -> None:
    points, simplices = MESHES[kind]
    flipped = np.concatenate([simplices[:, [1, 0]], simplices[:, 2:]], axis=1)
    assert (measures(points, flipped) < 0.0).all()
    assert (measures(points, oriented(points, flipped)) > 0.0).all()
