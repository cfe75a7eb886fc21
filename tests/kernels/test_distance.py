"""Signed distances against NumPy."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from flowborne.kernels.arrays import Nodes
from flowborne.kernels.distance import (
    BOX,
    CAPSULE,
    CYLINDER,
    ELLIPSOID,
    MESH,
    SPHERE,
    Samples,
    distances,
    signed_distance,
)
from flowborne.kernels.edge_crossings import Placed
from flowborne.kernels.node_distance import BAND, lower_to_body, merge, node_box
from flowborne.kernels.triangles import closest_on_triangle, distances_to_mesh, squared_distance

from .references.distance import signed_distance_reference
from .references.mesh_distance import distances_to_mesh_reference
from .references.node_distance import node_box_reference, sample_body_reference
from .references.triangles import closest_on_triangle_reference

KINDS = (SPHERE, CAPSULE, CYLINDER, BOX, ELLIPSOID, MESH)
SIZE = np.array([0.5, 0.7, 0.4])
VALUES = np.random.default_rng(0).standard_normal((5, 4, 6))
SAMPLES = Samples(np.array([-0.6, -0.4, -0.7]), 0.25, VALUES)
CUBE = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
SQUARES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
FACES = np.array([half for a, b, c, d in SQUARES for half in ((a, b, c), (a, c, d))])


@pytest.mark.parametrize("kind", KINDS)
def test_signed_distance(kind: int) -> None:
    points = np.random.default_rng(1).uniform(-1.5, 1.5, (200, 3))
    expected = signed_distance_reference(kind, SIZE, points, SAMPLES)
    assert (expected < 0.0).any()
    assert (expected > 0.0).any()
    found = [signed_distance(kind, SIZE, tuple(point), SAMPLES) for point in points]
    np.testing.assert_allclose(found, expected, atol=1e-13)
    if kind not in (ELLIPSOID, MESH):
        np.testing.assert_allclose(distances(kind, SIZE, points), expected, atol=1e-13)


def test_distance_off_an_ellipsoid_is_the_way_along_its_normal() -> None:
    random = np.random.default_rng(2)
    direction = random.normal(size=(100, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    normal = direction / SIZE
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    away = random.uniform(-0.15, 1.0, 100)  # inward less than the least radius of curvature
    points = SIZE * direction + away[:, None] * normal
    np.testing.assert_allclose(distances(ELLIPSOID, SIZE, points), away, atol=1e-9)


def test_closest_on_triangle() -> None:
    random = np.random.default_rng(3)
    places = set()
    for p, *corners in random.normal(size=(300, 4, 3)):
        weights = closest_on_triangle_reference(p, np.array(corners))
        found = closest_on_triangle(p, *corners)
        np.testing.assert_allclose(found, weights, atol=1e-10)
        square = float(np.square(weights @ corners - p).sum())
        assert squared_distance(p, *corners, found) == pytest.approx(square)
        places.add(tuple(weights > 1e-12))
    assert len(places) == 7  # each corner, each edge, and the inside


def test_distances_to_mesh() -> None:
    points = np.random.default_rng(6).uniform(-1.9, 1.9, (300, 3))
    given = points, CUBE + np.array([0.1, 0.05, -0.2]), FACES
    expected = distances_to_mesh_reference(*given)
    assert 0 < (expected < 0.0).sum() < expected.size
    np.testing.assert_allclose(distances_to_mesh(*given), expected, atol=1e-9)


@pytest.mark.parametrize("shape", [(14, 12, 13), (20, 15, 1)])
def test_a_body_of_several_geometries_at_the_nodes(shape: tuple[int, int, int]) -> None:
    random, count, flat = np.random.default_rng(4), len(KINDS), shape[2] == 1
    h, origin, limits = 0.25, np.array([-1.7, -1.6, -1.5]), np.array(shape)
    position = random.uniform(-0.5, 0.5, (count, 3))
    rotation = Rotation.random(count, random).as_matrix()
    reach, size = random.uniform(0.2, 0.4, (2, count, 3))
    nodes = Nodes(origin, h, flat)
    for geoms in (np.arange(count), np.array([2]), np.array([1, 4])):
        box = node_box(geoms, position, rotation, reach, nodes, limits)
        chosen = position[geoms], rotation[geoms], reach[geoms]
        np.testing.assert_array_equal(box, node_box_reference(*chosen, origin, h, limits))
        if flat:
            box[2] = 0, 2
        given = (box, geoms, np.array(KINDS), size, position, rotation, SAMPLES, origin, h, flat)
        expected = sample_body_reference(*given)
        phi = np.full(expected.shape, BAND * h)
        for g in geoms:
            at = position[g], rotation[g]
            body = Placed(KINDS[g], size[g], *at, SAMPLES)
            lower_to_body(phi, box, body, nodes)
        np.testing.assert_allclose(phi, expected, atol=1e-13)
        assert expected.max() <= BAND * h


def test_merge() -> None:
    random, box = np.random.default_rng(5), np.array([[1, 4], [0, 5], [2, 6]])
    distance, nearest = random.random((5, 5, 6)), random.integers(0, 3, (5, 5, 6))
    phi, inside = random.random((3, 5, 4)), tuple(slice(*ends) for ends in box)
    lower, body = distance.copy(), nearest.copy()
    lower[inside] = np.minimum(distance[inside], phi)
    body[inside] = np.where(phi < distance[inside], 7, nearest[inside])
    merge(distance, nearest, phi, box, 7)
    np.testing.assert_array_equal(distance, lower)
    np.testing.assert_array_equal(nearest, body)
