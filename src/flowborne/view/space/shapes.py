"""The geometries of the bodies as meshes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from flowborne.view.run import Geom

Array = NDArray[np.float64]

ROUND = 32
"""Sides of what is round."""

SHARP = 35.0
"""Angle between two faces from which on their edge is seen, degrees."""


LIT: dict[str, Any] = {
    "ambient": 0.22,
    "diffuse": 0.82,
    "specular": 0.12,
    "specular_power": 18.0,
    "interpolation": "phong",
}
"""How bodies and flesh take the light."""


def mesh_of(geom: Geom) -> pv.PolyData:
    """Surface of a geometry in its own frame, m, with normals to shade it by."""
    return _surface(geom).compute_normals(
        feature_angle=SHARP, split_vertices=True, consistent_normals=False
    )


def _surface(geom: Geom) -> pv.PolyData:
    a, b, c = geom.size
    if geom.mesh is not None:
        return pv.PolyData.from_regular_faces(*geom.mesh)
    if geom.kind == "box":
        return pv.Box((-a, a, -b, b, -c, c))
    if geom.kind == "capsule":
        return pv.Capsule(direction=(0, 0, 1), radius=a, cylinder_length=2.0 * b, resolution=ROUND)
    if geom.kind == "cylinder":
        return pv.Cylinder(direction=(0, 0, 1), radius=a, height=2.0 * b, resolution=ROUND)
    ball = pv.Sphere(radius=1.0, theta_resolution=ROUND, phi_resolution=ROUND)
    return ball.scale((a, a, a) if geom.kind == "sphere" else (a, b, c), inplace=True)
