"""Meshes have the size and the volume of the geometries that they show."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.shapes.primitives import shape_of
from flowborne.view.run import Geom
from flowborne.view.space.shapes import mesh_of

A, B, C = 0.2, 0.5, 0.3
TETRAHEDRON = (
    np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]),
    np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]),
)


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
