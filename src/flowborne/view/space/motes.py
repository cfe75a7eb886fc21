"""Points that stand still in the water behind what a camera follows."""

from __future__ import annotations

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from flowborne.fluid.grid import Grid
from flowborne.view import style
from flowborne.view.marks import motes

Array = NDArray[np.float64]

COUNT = 1200
"""Points within reach."""

REACH = 1.1
"""Distance from the focus at which they have faded away, in heights of the map."""

SIZE = 3.0
"""Pixels."""


class Motes:
    """The points in a plotter.

    height  m, of what is seen
    grid    of the fluid in which they are; None for all of space
    """

    def __init__(self, plotter: pv.Plotter, height: float, grid: Grid | None) -> None:
        self._reach, self._grid = REACH * height, grid
        self._mesh = pv.PolyData(motes(COUNT, np.zeros(3), self._reach))
        self._mesh.point_data["colour"] = np.tile(
            np.append(np.rint(255.0 * style.rgb(style.MOTES)), 255.0).astype(np.uint8), (COUNT, 1)
        )
        plotter.add_mesh(
            self._mesh, style="points", point_size=SIZE, scalars="colour", rgb=True, lighting=False
        )

    def show(self, focus: Array, toward: Array) -> None:
        """Show those around `focus` (3,), of which those before it, in the direction `toward` (3,)
        of the camera, are clear."""
        points = motes(COUNT, focus, self._reach)
        away = points - focus
        share = 1.0 - np.linalg.norm(away, axis=1) / self._reach
        share = np.minimum(share, -(away @ toward) / self._reach)
        if self._grid is not None:
            low, high = np.array(self._grid.origin), np.array(self._grid.upper)
            share[((points < low) | (points > high)).any(axis=1)] = 0.0
        self._mesh.points = points
        self._mesh.point_data["colour"][:, 3] = np.rint(
            255.0 * np.clip(3.0 * share, 0.0, 1.0)
        ).astype(np.uint8)
        self._mesh.Modified()
