"""A slice through the fluid in space, upright and across the camera's view, as a coloured plane."""

from __future__ import annotations

import numpy as np
import pyvista as pv
from numpy.typing import NDArray
from PIL import Image

from flowborne.fluid.grid import Grid
from flowborne.view.run import State
from flowborne.view.space.seen import SeenSlice

Array = NDArray[np.float64]

PIXELS = 1024
"""Longer side of the plane's image."""


class Slice:
    """The plane in a plotter.

    toward  (3,) direction of the camera at first, which says across which axis the slice is
    """

    def __init__(self, plotter: pv.Plotter, grid: Grid, seen: SeenSlice, toward: Array) -> None:
        self._grid, self._seen = grid, seen
        self._axis = int(np.argmax(np.abs(toward[:2])))
        first, second = (n for n in range(3) if n != self._axis)
        low, high = np.array(grid.origin), np.array(grid.upper)
        self._corners = np.tile(low, (4, 1))
        self._corners[[1, 2], first] = high[first]
        self._corners[[2, 3], second] = high[second]
        self._quad = pv.PolyData(self._corners, faces=[4, 0, 1, 2, 3])
        self._quad.active_texture_coordinates = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
        sides = np.array([grid.shape[first], grid.shape[second]])
        width, height = np.ceil(PIXELS * sides / sides.max()).astype(int).tolist()
        self._pixels = (width, height)
        self._actor = plotter.add_mesh(
            self._quad, lighting=False, texture=pv.Texture(np.zeros((2, 2, 3), np.uint8))
        )

    def show(self, state: State, focus: Array) -> None:
        """Show the slice of a state through `focus` (3,) m."""
        place = (focus[self._axis] - self._grid.origin[self._axis]) / self._grid.spacing
        image = self._seen.image(state, self._axis, place)
        small = Image.fromarray(np.ascontiguousarray(image.transpose(1, 0, 2)[::-1]))
        large = np.asarray(small.resize(self._pixels, Image.Resampling.BICUBIC))
        self._actor.texture = pv.Texture(large)
        self._corners[:, self._axis] = focus[self._axis]
        self._quad.points = self._corners.copy()
