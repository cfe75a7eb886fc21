"""How thick flesh is, from its skin alone."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from flowborne.shapes.thickness import thinnest
from flowborne.solids.flesh import outer_surface
from flowborne.validation.flesh_bars import bar_mesh


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


def test_sharp_rims_do_not_count() -> None:
    lens = trimesh.creation.icosphere(subdivisions=4)
    vertices = lens.vertices * np.array([1.0, 1.0, 0.1])
    assert 0.04 < thinnest(vertices, lens.faces, False) < 0.2
