"""How thick a body is, and how far its tips reach, from its skin alone."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from flowborne.shapes.mesh import ShapeMesh
from flowborne.shapes.own import ShapeOwn
from flowborne.shapes.primitives import PRIMITIVES, shape_of
from flowborne.shapes.thickness import sides, thin_parts, thinnest
from flowborne.solids.elements import outer_surface
from flowborne_validation.flesh_bars import bar_mesh


def test_thickness_of_simple_bodies() -> None:
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.5)
    assert thinnest(ball.vertices, ball.faces, False) == pytest.approx(1.0, rel=0.02)
    wall = trimesh.creation.annulus(0.4, 0.5, 2.0, sections=128)
    assert thinnest(wall.vertices, wall.faces, False) == pytest.approx(0.1, rel=0.02)


@pytest.mark.parametrize("slab", [False, True])
def test_a_flag_in_a_slab_is_not_as_thick_as_the_slab(slab: bool) -> None:
    points, elements = bar_mesh((8, 2, 1), (1.0, 0.2, 0.05))
    found = thinnest(points, outer_surface(points, elements), slab)
    assert found == pytest.approx(0.2 if slab else 0.05, rel=1e-12)


def test_a_flag_in_a_slab_has_no_tips_but_corners() -> None:
    """It is half as thick across the plane as the ball that looks for them."""
    points, elements = bar_mesh((8, 2, 1), (1.0, 0.2, 0.05))
    skin = outer_surface(points, elements)
    assert thin_parts(points, skin, 0.1) == 0.0
    assert 0.025 < thin_parts(points, sides(points, skin), 0.1) < 0.075


def test_sharp_rims_do_not_count() -> None:
    lens = trimesh.creation.icosphere(subdivisions=4)
    vertices = lens.vertices * np.array([1.0, 1.0, 0.1])
    assert 0.04 < thinnest(vertices, lens.faces, False) < 0.2


def wedge(angle: float) -> trimesh.Trimesh:
    """20 m long and wide, with its edge at x = 0."""
    high = 20.0 * np.tan(np.radians(0.5 * angle))
    ends = [(x, y, z) for z in (-10.0, 10.0) for x, y in ((0, 0), (20, -high), (20, high))]
    return trimesh.convex.convex_hull(np.array(ends))


class Ball:
    """A geometry whose distance no tips are found from."""

    def distance(self, points: np.ndarray) -> np.ndarray:
        return np.linalg.norm(points, axis=1) - 1.0

    def half_extents(self) -> np.ndarray:
        return np.ones(3)


def tips_of(mesh: trimesh.Trimesh, width: float) -> float:
    return thin_parts(np.asarray(mesh.vertices), np.asarray(mesh.faces), width)


@pytest.mark.parametrize("angle", [10.0, 20.0, 40.0])
@pytest.mark.parametrize("width", [0.5, 1.0])
def test_the_edge_of_a_wedge_is_thin_as_far_as_its_angle_says(angle: float, width: float) -> None:
    found = tips_of(wedge(angle), width)
    assert found == pytest.approx(0.5 * width / np.tan(np.radians(0.5 * angle)), abs=width / 3.0)


def test_the_point_of_a_cone_is_as_thin_as_the_edge_of_a_wedge() -> None:
    found = tips_of(trimesh.creation.cone(2.0, 20.0, sections=64), 1.0)
    assert found == pytest.approx(0.5 / np.tan(np.arctan(0.1)), rel=0.1)


def test_the_rim_of_a_lens_is_thin_where_its_sides_are_near() -> None:
    """Between two balls of radius 25 whose surfaces meet in a circle of radius 15 at 74 degrees,
    and of radius 100 at 17 degrees."""
    for radius, sharp in ((25.0, False), (100.0, True)):
        angle = np.arcsin(15.0 / radius)
        turn = np.linspace(0.0, angle, 60)
        cap = radius * np.stack([np.sin(turn), np.cos(turn) - np.cos(angle)], axis=1)
        profile = np.concatenate([cap, cap[-2::-1] * [1.0, -1.0]])
        lens = trimesh.creation.revolve(profile[::-1], sections=128)
        expected = 0.5 / np.tan(angle)
        found = tips_of(lens, 1.0)
        assert found == pytest.approx(expected, abs=1.0 / 3.0)
        assert (found > 1.0) == sharp


@pytest.mark.parametrize("size", [(3, 4, 5), (60, 60, 60), (60, 60, 2), (200, 200, 2), (60, 2, 2)])
def test_blocks_and_plates_have_no_tips(size: tuple[float, ...]) -> None:
    """Of a right angle the ball leaves half its width."""
    assert tips_of(trimesh.creation.box(size), 1.0) < 0.75


@pytest.mark.parametrize("length", [1e6, 1e145])
def test_a_sliver_without_end_is_not_cut_into_pieces_without_end(length: float) -> None:
    corners = np.array([[0, 0, 0], [length, 0, 0], [length, 0.1, 0], [0, 0.1, 0]])
    points = np.concatenate([corners, corners + np.array([0.0, 0.0, 0.1])])
    skin = np.array([[n, (n + 1) % 4, (n + 1) % 4 + 4] for n in range(4)])
    assert np.isfinite(thin_parts(points, skin, 0.05))


@pytest.mark.parametrize("thick", [0.9, 0.3, 0.03, 0.001])
def test_what_is_thin_everywhere_has_no_tips(thick: float) -> None:
    assert tips_of(trimesh.creation.box((30.0, 30.0, thick)), 1.0) == 0.0


def test_only_an_ellipsoid_among_the_primitives_is_sharp() -> None:
    size = np.array([20.0, 20.0, 1.0])
    rim = {kind: shape_of(kind, size, None).tips(1.0) for kind in PRIMITIVES}
    assert rim.pop("ellipsoid") == pytest.approx(20.0 * (1.0 - np.sqrt(0.75)), abs=1.0 / 3.0)
    assert set(rim.values()) == {0.0}


def test_what_is_seen_thicker_all_around_is_blunter_by_that() -> None:
    mesh, still = wedge(20.0), (np.zeros(3), np.eye(3))
    skin = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    expected = {0.0: 0.5, 0.25: 0.25, 0.5: 0.0, 0.6: 0.0}
    for offset, radius in expected.items():
        found = ShapeOwn(Ball(), *still, *skin, offset).tips(1.0)
        assert found == pytest.approx(radius / np.tan(np.radians(10.0)), abs=1.0 / 3.0)


def test_of_a_slab_only_the_outline_counts() -> None:
    """A wedge lies with its edge along z, then across it: as a triangle, then as a rectangle."""
    mesh = wedge(20.0)
    shape = ShapeMesh(np.asarray(mesh.vertices), np.asarray(mesh.faces))
    expected = 0.5 / np.tan(np.radians(10.0))
    assert shape.section(np.eye(3), 0.0).tips(1.0) == pytest.approx(expected, abs=1.0 / 3.0)
    upright = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    assert shape.section(upright, -15.0).tips(1.0) < 0.75
    ellipse = shape_of("ellipsoid", np.array([20.0, 1.0, 20.0]), None).section(np.eye(3), 0.0)
    assert ellipse.tips(1.0) == pytest.approx(20.0 * (1.0 - np.sqrt(0.75)), abs=1.0 / 3.0)


def test_a_mesh_that_is_thickened_all_over_has_no_tips() -> None:
    box = trimesh.creation.box((1.0, 1.0, 0.01))
    plate = ShapeMesh(np.asarray(box.vertices), np.asarray(box.faces))
    assert plate.thickened(1.0).tips(0.5) == 0.0
