"""The map of a run in three dimensions, drawn by VTK."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from matplotlib.artist import Artist
from matplotlib.axes import Axes

from flowborne.view.fields import Scale
from flowborne.view.forces import Forces
from flowborne.view.map_image import MapImage
from flowborne.view.run import Run, State
from flowborne.view.shot import Shot
from flowborne.view.space.camera import camera_of
from flowborne.view.space.opengl import off_screen
from flowborne.view.space.seen import seen_of

if TYPE_CHECKING:
    from flowborne.view.space.stage import Stage


class MapSpace:
    """Map of space, a `Map` of view.pictures.

    camera  from which it is seen
    """

    def __init__(self, run: Run, shot: Shot, aspect: float | None = None) -> None:
        """`aspect`: height over width that the map must have, if any."""
        self.run = run
        self._shot = shot
        self.camera = camera_of(run, shot, aspect)
        self.width, self.aspect = self.camera.width, self.camera.aspect
        self.forces = Forces(run, min(self.camera.width, self.camera.height))
        self._seen = seen_of(run, shot)
        self.legend: Sequence[tuple[str, str]] = () if self._seen is None else self._seen.legend
        self.scale: Scale | None = None if self._seen is None else self._seen.scale
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
            plotter, self.run, self.camera, self.forces, self._seen, pixel, self._shot
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
