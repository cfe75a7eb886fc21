"""A wind as rows of arrows behind the bodies, which drift with it."""

from __future__ import annotations

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from flowborne.view import style
from flowborne.view.run import Run
from flowborne.view.space.arrows import Arrows
from flowborne.view.space.camera import Camera

Array = NDArray[np.float64]

ROWS = 7
"""Rows of arrows from the lower to the upper edge of the map."""

BEHIND = 0.5
"""Distance of the arrows behind the middle of the bodies, in heights of the map."""

LENGTH, WIDTH = 0.42, 0.03
"""Of an arrow and of its shaft, in distances from row to row."""

PACE = 0.22
"""Largest drift from frame to frame, in distances from row to row: the eye takes a faster one for
one backwards."""


class WindArrows:
    """Arrows along the wind of a run in a plotter.

    lowest  m, height below which there are none
    """

    def __init__(self, plotter: pv.Plotter, run: Run, camera: Camera, lowest: float) -> None:
        wind = run.wind.sum(axis=0)
        speed = float(np.linalg.norm(wind))
        pitch = camera.height / ROWS
        self._camera = camera
        self._drift = wind * min(1.0, PACE * pitch * run.frames_per_second / speed)
        self._vector = LENGTH * pitch * wind / speed
        self._width = WIDTH * pitch
        self._lowest = lowest + 0.5 * pitch
        right, up, _ = camera.axes(0)
        self._set_lattice(pitch, rows=abs(wind @ right) >= abs(wind @ up))
        self._arrows = Arrows(plotter, len(self._lattice), style.WIND, 0.3)

    def show(self, number: int, time: float) -> None:
        """Show the arrows of a frame, which stay in the moving air and not before the camera."""
        focus = self._camera.focus[number]
        axes = self._camera.axes(number)
        on, toward = axes[:2], axes[2]
        moved = (self._drift * time - focus) @ on.T
        on_map = self._lattice + moved % self._period
        places = focus + on_map @ on - BEHIND * self._camera.height * toward
        tails = (places - 0.5 * self._vector)[places[:, 2] > self._lowest]
        self._arrows.show(tails, np.broadcast_to(self._vector, tails.shape), self._width)

    def _set_lattice(self, pitch: float, rows: bool) -> None:
        """Places that cover the map behind the bodies wherever in its period the pattern stands.

        Every other row (or column) is shifted by half.
        """
        camera = self._camera
        farther = 1.0 + BEHIND * camera.height / camera.distance
        half = 0.5 * farther * np.array([camera.width, camera.height])
        count = np.ceil(half / pitch).astype(int) + 1
        a, b = (x.ravel() for x in np.meshgrid(*(np.arange(-n - 2.0, n + 1.0) for n in count)))
        lattice = [a + 0.5 * (b % 2), b] if rows else [a, b + 0.5 * (a % 2)]
        self._lattice = pitch * np.stack(lattice, axis=1)
        self._period = pitch * np.array([1.0, 2.0] if rows else [2.0, 1.0])
