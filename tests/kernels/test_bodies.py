"""Wind on patches, momenta and thickness against NumPy."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from flowborne.kernels.momentum import about_origin, momentum_impulse
from flowborne.kernels.thickness import any_within, by_cells, way_inward
from flowborne.kernels.triangles import crossings
from flowborne.kernels.wind import places, pushed

from .references.crossings import crossings_reference
from .references.momentum import about_origin_reference, momentum_impulse_reference
from .references.thickness import any_within_reference, way_inward_reference
from .references.wind import pushed_reference


@pytest.mark.parametrize("winds", [1, 40])
def test_pushed_is_eq_2_patch_by_patch(winds: int) -> None:
    random = np.random.default_rng(5)
    n, bodies = 40, 3
    body = np.sort(random.integers(0, bodies, n))
    centre, normal, position = (random.normal(size=(m, 3)) for m in (n, n, bodies))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    rotation = np.linalg.qr(random.normal(size=(bodies, 3, 3)))[0]
    twist, area = random.normal(size=(bodies, 6)), random.uniform(0.1, 1.0, n)
    moving, wind = (position, rotation, twist), random.normal(size=(winds, 3))
    expected = pushed_reference(body, centre, normal, area, *moving, wind)
    screw = np.concatenate([normal, np.cross(centre, normal)], axis=1)
    np.testing.assert_allclose(pushed(body, screw, area, *moving, wind), expected, atol=1e-12)
    x = position[body] + np.einsum("nij,nj->ni", rotation[body], centre)
    np.testing.assert_allclose(places(body, centre, position, rotation), x, atol=1e-12)


def test_about_origin() -> None:
    given = np.random.default_rng(6).normal(size=(3, 7, 3))
    np.testing.assert_allclose(about_origin(*given), about_origin_reference(*given), atol=1e-14)


@pytest.mark.parametrize("dofs", [0, 8])
def test_momentum_impulse(dofs: int) -> None:
    random = np.random.default_rng(dofs)
    twist = random.normal(size=(dofs, 6))
    body, conserved = random.integers(5, size=dofs), random.uniform(size=dofs) < 0.5
    momenta, forces = random.normal(size=(2, 5, 6)), random.normal(size=(4, dofs))
    given = twist, (*momenta, body), conserved, *forces, 0.2
    impulse, rounding = momentum_impulse(*given)
    expected, room = momentum_impulse_reference(*given)
    np.testing.assert_allclose(impulse, expected, rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(rounding, room, rtol=1e-13)


def test_way_inward() -> None:
    """Random triangles, and the way out on most of them."""
    random = np.random.default_rng(7)
    vertices = random.normal(size=(30, 3))
    triangles = np.array([random.choice(30, 3, replace=False) for _ in range(60)])
    expected = way_inward_reference(vertices, triangles)
    assert np.isinf(expected).any()
    assert np.isfinite(expected).sum() > 20
    np.testing.assert_allclose(way_inward(vertices, triangles), expected, rtol=1e-9)


def test_triangles_within_a_radius_and_lines_through_them() -> None:
    mesh = trimesh.creation.torus(0.5, 0.2, major_sections=12, minor_sections=8)
    vertices, triangles = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    places = np.random.default_rng(0).uniform(-0.9, 0.9, (60, 3))
    found = any_within(places, 0.1, vertices, triangles, by_cells(vertices, triangles))
    np.testing.assert_array_equal(found, any_within_reference(places, 0.1, vertices, triangles))
    assert 0 < found.sum() < 60
    direction = np.array([0.3, -0.4, 0.8])
    ours = crossings(vertices, triangles, places, direction)
    theirs = crossings_reference(vertices, triangles, places, direction)
    order, expected = np.lexsort(ours[1::-1]), np.lexsort(theirs[1::-1])
    for one, other in zip(ours, theirs, strict=True):
        np.testing.assert_allclose(one[order], other[expected], rtol=1e-9)


def test_way_inward_on_edges_of_the_cells() -> None:
    """Rays from a box in its own axes run along faces between cells."""
    size = np.array([2.0, 1.0, 0.5])
    box = trimesh.creation.box(size).subdivide().subdivide()
    way = way_inward(box.vertices, box.faces)
    np.testing.assert_allclose(way, np.abs(box.face_normals) @ size, rtol=1e-12)
