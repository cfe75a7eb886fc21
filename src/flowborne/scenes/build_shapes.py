"""The [[shapes]] of a scene: geometries of the user's own on the bodies of its model."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from flowborne.scenes.schema import Scene
from flowborne.scenes.schema_solids import ShapeTable
from flowborne.shapes.own import SHAPES, PlacedShape

Array = NDArray[np.float64]


def placed_shapes(scene: Scene) -> tuple[PlacedShape, ...]:
    """The geometries in the order of the scene."""
    return tuple(
        PlacedShape(
            SHAPES.make(table.kind, table.parameters),
            table.body,
            np.array(table.position),
            _rotation(table),
            table.density,
        )
        for table in scene.shapes
    )


def _rotation(table: ShapeTable) -> Array:
    """(3, 3) the shape's frame to the body's; along an axis the least turn of its z."""
    if table.axis is None:
        turn = Rotation.from_euler("XYZ", table.euler or (0.0, 0.0, 0.0), degrees=True)
    else:
        z = np.array(table.axis) / np.linalg.norm(table.axis)
        across = np.cross([0.0, 0.0, 1.0], z)
        sine = float(np.linalg.norm(across))
        way = across / sine if sine > 0.0 else np.array([1.0, 0.0, 0.0])
        turn = Rotation.from_rotvec(np.arctan2(sine, z[2]) * way)
    return np.asarray(turn.as_matrix())
