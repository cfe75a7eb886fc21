"""The map of a run in three dimensions, drawn by VTK."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from numpy.typing import NDArray

from flowborne.view.forces import Forces
from flowborne.view.map_image import MapImage
from flowborne.view.run import Run, State
from flowborne.view.space.camera import camera_of
from flowborne.view.space.clouds import cloud_of
from flowborne.view.space.opengl import off_screen

if TYPE_CHECKING:
    from flowborne.view.space.stage import Stage

Array = NDArray[np.float64]


class MapSpace:
    """Map of space, a `Map` of view.pictures.

    camera  from which it is seen
    """

    def __init__(self, run: Run, bones: bool = False) -> None:
        """`bones`: see through flesh, to the bones in it."""
        self.run = run
        self._bones = bones
        self.camera = camera_of(run)
        self.width, self.aspect = self.camera.width, self.camera.aspect
        self.forces = Forces(run, min(self.camera.width, self.camera.height))
        self._cloud = cloud_of(run)
        self.legend: Sequence[tuple[str, str]] = () if self._cloud is None else self._cloud.legend
        self.scale: tuple[Array, float, float, str] | None = None
        self._stage: Stage | None = None

    def draw_on(self, axes: Axes, pixels: int) -> Sequence[Artist]:
        """Set the stage; the artist of what is seen of it in `axes`, `pixels` wide at scale 1.

        raises  ValueError when nothing can draw three dimensions here
        """
        self._image = MapImage(axes)
        plotter = off_screen(*self._image.pixels)
        # imports VTK, which is known to work from here on
        from flowborne.view.space.stage import Stage

        pixel = self.width / pixels
        self._stage = Stage(
            plotter, self.run, self.camera, self.forces, self._cloud, pixel, self._bones
        )
        return [self._image]

    def show(self, number: int, state: State) -> None:
        """Make what is seen that of the `number`-th state."""
        assert self._stage is not None
        self._image.image = self._stage.image(number, state)

    def close(self) -> None:
        """Close VTK's window; nothing can be drawn after."""
        if self._stage is not None:
            self._stage.close()
