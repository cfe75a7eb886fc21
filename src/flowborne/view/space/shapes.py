"""The geometries of the bodies as meshes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from flowborne.view import style
from flowborne.view.run import Geom

SHARP = 35.0
"""Angle between two faces from which on their edge is seen, degrees."""

UNCOLOURED = (0.5, 0.5, 0.5, 1.0)
"""Colour of a geometry to which the model gives none."""

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


def colour_of(geom: Geom, accented: frozenset[int]) -> tuple[NDArray[np.float64], float]:
    """(3,) colour of a geometry, the model's own unless it stands fixed or is accented, and its
    opacity, from 0 to 1."""
    own = np.round(geom.rgba, 6)
    plain = tuple(own) == UNCOLOURED or geom.body == 0 or geom.body in accented
    colour = style.rgb(style.body_colour(geom.body, accented)) if plain else own[:3]
    return colour, float(geom.rgba[3])
