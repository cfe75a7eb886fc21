"""Every kind of shape keeps the contract, and its parts agree with each other."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from flowborne.shapes.mesh import ShapeMesh
from flowborne.shapes.primitives import PRIMITIVES, shape_of
from flowborne.shapes.shape import ENDLESS, Shape, lattice_points

SIZE = np.array([0.3, 0.5, 0.2])
TORUS = trimesh.creation.torus(0.5, 0.2, major_sections=24, minor_sections=12)
SHAPES: list[Shape] = [
    *(shape_of(kind, SIZE, None) for kind in PRIMITIVES),
    ShapeMesh(np.asarray(TORUS.vertices), np.asarray(TORUS.faces)),
]
EACH = pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.kind)


@EACH
def test_what_is_drawn_encloses_the_volume(shape: Shape) -> None:
    vertices, faces = shape.triangles()
    drawn = trimesh.Trimesh(vertices, faces, process=False)
    assert drawn.is_watertight
    assert drawn.volume == pytest.approx(shape.volume, rel=0.02)
    np.testing.assert_allclose(drawn.bounds[1], shape.reach, rtol=5e-3)
    assert np.abs(shape.distance(np.ascontiguousarray(vertices))).max() < 1e-9


@EACH
def test_patches_close_and_enclose_the_volume(shape: Shape) -> None:
    centre, vector = shape.patches()
    np.testing.assert_allclose(vector.sum(axis=0), 0.0, atol=1e-12)
    assert (centre * vector).sum() / 3.0 == pytest.approx(shape.volume, rel=0.02)


@EACH
def test_lines_cross_as_much_as_the_volume_and_where_the_distance_is_nought(shape: Shape) -> None:
    turn = Rotation.from_euler("xyz", [0.3, 0.2, 0.4]).as_matrix()
    ticks = (np.arange(80) + 0.5) / 40.0 - 1.0
    x, y = np.meshgrid(ticks, ticks, indexing="ij")
    origins = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1) @ turn.T
    line, place, sign = shape.crossings(origins, turn[:, 2])
    assert -(place * sign).sum() / 40.0**2 == pytest.approx(shape.volume, rel=2e-3)
    found = origins[line] + place[:, None] * turn[:, 2]
    assert np.abs(shape.distance(np.ascontiguousarray(found))).max() < 1e-9


@EACH
def test_landmarks_lie_on_the_surface_and_reach_as_far(shape: Shape) -> None:
    places = shape.landmarks()
    assert np.abs(shape.distance(np.ascontiguousarray(places))).max() < 1e-9
    for some in (places, shape.outermost()):
        np.testing.assert_allclose(np.abs(some).max(axis=0), shape.reach, rtol=1e-12)


@EACH
def test_area_of_the_section_is_how_the_volume_grows(shape: Shape) -> None:
    """Over all heights the sections of a shape that stands upright add up to its volume."""
    heights = shape.reach[2] * ((np.arange(200) + 0.5) / 100.0 - 1.0)
    areas = [shape.section(np.eye(3), height).area for height in heights]
    assert shape.reach[2] / 100.0 * sum(areas) == pytest.approx(shape.volume, rel=2e-3)
    with pytest.raises(ValueError, match="misses"):
        shape.section(np.eye(3), 1.01 * shape.reach[2])


THICKNESS = {"box": 0.4, "ellipsoid": 0.4, "mesh": 0.4 * np.cos(np.pi / 12.0)}
"""m, of the thin ones; a polygon of twelve sides is as thick as between two of them."""


@EACH
def test_what_is_thick_is_not_thickened(shape: Shape) -> None:
    assert shape.thickness == pytest.approx(THICKNESS.get(shape.kind, 0.6), rel=0.02)
    same = shape.thickened(0.5 * shape.thickness * (1.0 - 1e-9))
    points = np.random.default_rng(0).uniform(-1.0, 1.0, (50, 3))
    np.testing.assert_allclose(same.distance(points), shape.distance(points), rtol=1e-12)


@EACH
def test_endless_it_has_its_section_at_any_height(shape: Shape) -> None:
    prism = shape.endless(np.eye(3), 0.0)
    if prism is not shape:
        points = np.random.default_rng(1).uniform(-0.6, 0.6, (200, 3))
        inside = prism.distance(points * [1.0, 1.0, 0.1]) < 0.0
        flat = points * [1.0, 1.0, 0.0]
        np.testing.assert_array_equal(inside, shape.distance(flat) < 0.0)
        assert prism.reach.max() < ENDLESS


def test_thin_parts_of_a_mesh_become_sheets_no_longer_than_it() -> None:
    """A tube with walls of 0.02 m, thickened to 0.2 m: where its corners are moved along normals
    its inner side folds."""
    tube = trimesh.creation.annulus(0.12, 0.14, 0.4, sections=64)
    shape = ShapeMesh(np.asarray(tube.vertices), np.asarray(tube.faces))
    thick = shape.thickened(0.1)
    assert thick.thickness == pytest.approx(0.2)
    assert thick.tips(0.15) == 0.0
    found = thick.samples(0.1)
    assert found is not None
    places = lattice_points(found.corner, found.pitch, np.array(found.values.shape))
    inside = found.values.ravel() < 0.0
    radius, height = np.hypot(places[:, 0], places[:, 1]), np.abs(places[:, 2])
    off = np.maximum(np.abs(radius - 0.13) - 0.1, height - 0.2)
    np.testing.assert_array_equal(inside[off < -0.003], True)
    np.testing.assert_array_equal(inside[off > 0.003], False)
