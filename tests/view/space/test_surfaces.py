"""Meshes of geometries have their size, and an arrow starts where its line leaves the body."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.shapes.primitives import shape_of
from flowborne.view.run import Geom
from flowborne.view.space.surfaces import Outside, mesh_of

A, B, C = 0.2, 0.5, 0.3
TETRAHEDRON = (
    np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]),
    np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]),
)

TURN = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""The geometry's x is the world's y, its y z and its z x."""

PLACE = np.array([3.0, 4.0, 5.0])


@pytest.mark.parametrize(
    ("kind", "volume"),
    [
        ("sphere", 4.0 / 3.0 * np.pi * A**3),
        ("capsule", 4.0 / 3.0 * np.pi * A**3 + 2.0 * np.pi * A**2 * B),
        ("cylinder", 2.0 * np.pi * A**2 * B),
        ("box", 8.0 * A * B * C),
        ("ellipsoid", 4.0 / 3.0 * np.pi * A * B * C),
        ("mesh", 1.0 / 6.0),
    ],
)
def test_a_mesh_is_the_geometry(kind: str, volume: float) -> None:
    mesh = TETRAHEDRON if kind == "mesh" else None
    geom = Geom(shape_of(kind, np.array([A, B, C]), mesh), 1, np.ones(4))
    drawn = mesh_of(geom)
    assert drawn.volume == pytest.approx(volume, rel=0.02)
    points, reach = np.asarray(drawn.points), geom.shape.outermost()
    np.testing.assert_allclose(points.max(axis=0), reach.max(axis=0), atol=2e-3)
    np.testing.assert_allclose(points.min(axis=0), reach.min(axis=0), atol=2e-3)
    outward = np.sum((points - points.mean(axis=0)) * drawn.point_data["Normals"], axis=1)
    assert outward.min() > 0.0


def geom(kind: str, size: tuple[float, float, float], body: int = 1) -> Geom:
    return Geom(shape_of(kind, np.array(size), None), body, np.ones(4))


def skin_of(*geoms: Geom) -> Outside:
    return Outside(geoms)


@pytest.mark.parametrize(
    ("kind", "size", "vector", "reach"),
    [
        ("box", (0.1, 0.2, 0.3), (5.0, 0.0, 0.0), 0.3),
        ("box", (0.1, 0.2, 0.3), (0.0, -2.0, 0.0), 0.1),
        ("box", (0.1, 0.2, 0.3), (0.0, 1.0, 1.0), 0.1 * np.sqrt(2.0)),
        ("sphere", (0.4, 0.0, 0.0), (1.0, -2.0, 3.0), 0.4),
        ("capsule", (0.1, 0.5, 0.0), (0.1, 0.0, 0.0), 0.6),
        ("cylinder", (0.1, 0.5, 0.0), (0.0, 0.0, 9.0), 0.1),
        ("ellipsoid", (0.1, 0.2, 0.3), (0.0, 0.0, 1.0), 0.2),
    ],
)
def test_the_line_leaves_the_body_at_its_surface(
    kind: str, size: tuple[float, float, float], vector: tuple[float, ...], reach: float
) -> None:
    state = {"geom_position": PLACE[None], "geom_rotation": TURN[None]}
    found = skin_of(geom(kind, size)).reach(1, PLACE, np.array(vector), state, ())
    assert found == pytest.approx(reach, rel=0.01)


def test_of_several_parts_the_farthest_that_holds_the_place_counts() -> None:
    skin = skin_of(
        geom("sphere", (0.1, 0.0, 0.0)),
        geom("sphere", (0.3, 0.0, 0.0)),
        geom("sphere", (0.3, 0.0, 0.0)),
        geom("sphere", (9.0, 0.0, 0.0), body=2),
    )
    places = np.array([[0.0, 0, 0], [0.1, 0, 0], [0.8, 0, 0], [0, 0, 0]])
    state = {"geom_position": places, "geom_rotation": np.broadcast_to(np.eye(3), (4, 3, 3))}
    along = np.array([2.0, 0.0, 0.0])
    assert skin.reach(1, np.zeros(3), along, state, ()) == pytest.approx(0.4, rel=0.01)
    assert skin.reach(1, np.array([5.0, 0.0, 0.0]), along, state, ()) == 0.0
