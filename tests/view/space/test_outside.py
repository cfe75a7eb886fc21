"""An arrow starts where the line of its force leaves the body."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.shapes.primitives import shape_of
from flowborne.view.run import Geom
from flowborne.view.space.outside import Outside
from flowborne.view.space.shapes import mesh_of

TURN = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""The geometry's x is the world's y, its y z and its z x."""

PLACE = np.array([3.0, 4.0, 5.0])


def geom(kind: str, size: tuple[float, float, float], body: int = 1) -> Geom:
    return Geom(shape_of(kind, np.array(size), None), body, np.ones(4))


def skin_of(*geoms: Geom) -> Outside:
    return Outside(geoms, [mesh_of(geom) for geom in geoms])


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
    state = {
        "geom_position": places,
        "geom_rotation": np.broadcast_to(np.eye(3), (4, 3, 3)),
    }
    along = np.array([2.0, 0.0, 0.0])
    assert skin.reach(1, np.zeros(3), along, state, ()) == pytest.approx(0.4, rel=0.01)
    assert skin.reach(1, np.array([5.0, 0.0, 0.0]), along, state, ()) == 0.0
