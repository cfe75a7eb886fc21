"""The geometries of the bodies as meshes."""

from __future__ import annotations

from typing import Any

import pyvista as pv

from flowborne.view.run import Geom

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
    return pv.PolyData.from_regular_faces(*geom.shape.triangles()).compute_normals(
        feature_angle=SHARP, split_vertices=True, consistent_normals=False
    )
