"""The map of a run in two dimensions: its fluid, its bodies and the forces on them from above."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PathCollection, PolyCollection
from matplotlib.path import Path
from numpy.typing import NDArray

from flowborne.view import style
from flowborne.view.arrows import arrow
from flowborne.view.fields import field_of, over
from flowborne.view.forces import SHAFT, Forces
from flowborne.view.map_image import MapImage
from flowborne.view.marks import crosses, goes_along
from flowborne.view.outlines import Outlines, flesh_loops
from flowborne.view.run import Run, State
from flowborne.view.shot import Shot
from flowborne.view.window import windows

Array = NDArray[np.float64]

WIND_ROWS = 9
"""Rows of arrows that show a wind, along the map's smaller side."""


class MapSlab:
    """Map of a slab, a `Map` of view.pictures.

    views  (frames, 4) m, (x0, x1, y0, y1) of each frame
    """

    def __init__(self, run: Run, shot: Shot, aspect: float | None = None) -> None:
        """`aspect`: height over width that the map must have, if any."""
        self.run = run
        self._shot = shot
        self._shown = [n for n, geom in enumerate(run.geoms) if shot.bones or not geom.covered]
        self._field = field_of(run, shot)
        self._outlines = Outlines(run)
        self.views = windows(run, self._outlines, shot, aspect)
        x0, x1, y0, y1 = self.views[0]
        self.width = float(x1 - x0)
        self.aspect = float((y1 - y0) / (x1 - x0))
        self._side = float(min(x1 - x0, y1 - y0))
        self.forces = Forces(run, self._side)
        self.legend = () if self._field is None else self._field.legend
        self.scale = None if self._field is None else self._field.scale

    def draw_on(self, axes: Axes, pixels: int) -> Sequence[Artist]:
        """Draw what stands still in `axes`, `pixels` wide; the artists of what moves."""
        self._pixel = self.width / pixels
        self._axes = axes
        self._look(0)
        moving: list[Artist] = []
        self._wind = PolyCollection([], facecolors=style.WIND, edgecolors="none", animated=True)
        if self._field is not None and self.run.grid is not None:
            (x0, y0, _), (x1, y1, _) = self.run.grid.origin, self.run.grid.upper
            self._water = MapImage(axes, (x0, x1, y0, y1))
            moving.append(self._water)
        elif self.run.wind.any():
            axes.add_collection(self._wind)
            moving.append(self._wind)
        self._marks: LineCollection | None = None
        if goes_along(self.views, self._side) and not self._shot.transparent:
            self._marks = LineCollection([], colors=style.MOTES, linewidths=1.0, animated=True)
            axes.add_collection(self._marks)
            moving.append(self._marks)
        bodies = [self.run.geoms[n].body for n in self._shown]
        colours = [style.body_colour(body, self.run.accented) for body in bodies]
        edged: dict[str, Any] = {"edgecolors": style.EDGE, "linewidths": 1.1, "joinstyle": "round"}
        self._bodies = PolyCollection([], facecolors=colours, **edged)
        # below bones it is as dark as if they were seen through it, but hides the field's cells
        share = style.SEEN_THROUGH if self._shot.bones else 1.0
        flesh = share * style.rgb(style.FLESH) + (1.0 - share) * style.rgb(self._shot.colour)
        self._flesh = PathCollection([], facecolors=[tuple(flesh)], **edged)
        self._arrows = PolyCollection(
            [], facecolors=style.FORCE, edgecolors=style.EDGE, linewidths=0.8
        )
        solids = (self._flesh, self._bodies) if self._shot.bones else (self._bodies, self._flesh)
        for collection in (*solids, self._arrows):
            collection.set_animated(True)
            axes.add_collection(collection)
            moving.append(collection)
        return moving

    def show(self, number: int, state: State) -> None:
        """Make what moves that of the `number`-th state."""
        self._look(number)
        if self._field is not None:
            image = self._field.image(state)
            self._water.image = image if self._shot.transparent else over(image, self._shot.colour)
        elif self.run.wind.any():
            corner, wind = self.views[0, [0, 2]], self.run.wind.sum(axis=0)[:2]
            self._wind.set_verts(wind_arrows(self.views[number], corner, wind))
        if self._marks is not None:
            x0, x1, y0, y1 = self.views[number]
            self._marks.set_segments(
                list(crosses(np.array([x0, y0]), np.array([x1, y1]), self._side))
            )
        outlines = self._outlines.placed(state)
        self._bodies.set_verts([outlines[n] for n in self._shown])
        loops = flesh_loops(self.run, state)
        # one path of all, so that what flesh goes around stays empty
        self._flesh.set_paths([Path.make_compound_path(*_closed(loops))] if loops else [])
        width = SHAFT * self._pixel
        arrows = self.forces.arrows(state, self._pixel)
        self._arrows.set_verts([arrow(tail, vector, width) for _, tail, vector in arrows])

    def close(self) -> None:
        """Nothing is held."""

    def _look(self, number: int) -> None:
        x0, x1, y0, y1 = self.views[number]
        self._axes.set(xlim=(x0, x1), ylim=(y0, y1))


def _closed(loops: list[Array]) -> list[Path]:
    return [Path(np.concatenate([loop, loop[:1]]), closed=True) for loop in loops]


def wind_arrows(view: Array, corner: Array, wind: Array) -> list[Array]:
    """Grid of arrows along `wind` (2,) over the map `view`, every other row shifted by half.

    It stands in the world, whatever part of it is seen.

    corner  (2,) m, where its lower left square is
    """
    x0, x1, y0, y1 = view
    pitch = min(x1 - x0, y1 - y0) / WIND_ROWS
    vector = 0.42 * pitch * wind / np.hypot(*wind)
    first = np.floor((np.array([x0, y0]) - corner) / pitch + 1e-6).astype(int)
    last = np.ceil((np.array([x1, y1]) - corner) / pitch - 1e-6).astype(int)
    arrows = []
    for row in range(first[1], last[1]):
        for column in range(first[0], last[0]):
            middle = corner + pitch * (np.array([column + 0.5 * (row % 2), row]) + 0.5)
            arrows.append(arrow(middle - 0.5 * vector, vector, 0.035 * pitch))
    return arrows
