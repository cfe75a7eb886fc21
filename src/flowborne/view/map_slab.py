"""The map of a run in two dimensions: its fluid, its bodies and the forces on them from above."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection, PolyCollection
from matplotlib.path import Path
from numpy.typing import NDArray

from flowborne.view import style
from flowborne.view.arrows import arrow
from flowborne.view.fields import SAMPLES, field_of
from flowborne.view.forces import SHAFT, Forces
from flowborne.view.map_image import MapImage
from flowborne.view.outlines import Outlines, skin_loops
from flowborne.view.run import Run, State

Array = NDArray[np.float64]

WIND_ROWS = 9
"""Rows of arrows that show a wind, along the map's smaller side."""


class MapSlab:
    """Map of a slab, a `Map` of view.pictures.

    view  (x0, x1, y0, y1), m
    """

    def __init__(self, run: Run, bones: bool = False) -> None:
        """`bones`: show the bones in flesh."""
        self.run = run
        self._bones = bones
        self._shown = [n for n, geom in enumerate(run.geoms) if bones or not geom.covered]
        self._field = field_of(run)
        self._outlines = Outlines(run)
        self.view = view_of(run, self._outlines)
        x0, x1, y0, y1 = self.view
        self.width = x1 - x0
        self.aspect = (y1 - y0) / (x1 - x0)
        self.forces = Forces(run, min(x1 - x0, y1 - y0))
        self.legend = () if self._field is None else self._field.legend
        self.scale = None if self._field is None else self._field.scale

    def draw_on(self, axes: Axes, pixels: int) -> Sequence[Artist]:
        """Draw what stands still in `axes`, `pixels` wide; the artists of what moves."""
        self._pixel = self.width / pixels
        x0, x1, y0, y1 = self.view
        axes.set(xlim=(x0, x1), ylim=(y0, y1))
        moving: list[Artist] = []
        if self._field is not None:
            self._water = MapImage(axes)
            moving.append(self._water)
        elif self.run.wind.any():
            arrows = wind_arrows(self.view, self.run.wind.sum(axis=0)[:2])
            axes.add_collection(PolyCollection(arrows, facecolors=style.WIND, edgecolors="none"))
        bodies = [self.run.geoms[n].body for n in self._shown]
        colours = [style.body_colour(body, self.run.accented) for body in bodies]
        edged: dict[str, Any] = {"edgecolors": style.EDGE, "linewidths": 1.1, "joinstyle": "round"}
        self._bodies = PolyCollection([], facecolors=colours, **edged)
        # below bones it is as dark as if they were seen through it, but hides the field's cells
        share = style.SEEN_THROUGH if self._bones else 1.0
        flesh = share * style.rgb(style.FLESH) + (1.0 - share) * style.rgb(style.WATER)
        self._flesh = PathCollection([], facecolors=[tuple(flesh)], **edged)
        self._arrows = PolyCollection(
            [], facecolors=style.FORCE, edgecolors=style.EDGE, linewidths=0.8
        )
        solids = (self._flesh, self._bodies) if self._bones else (self._bodies, self._flesh)
        for collection in (*solids, self._arrows):
            collection.set_animated(True)
            axes.add_collection(collection)
            moving.append(collection)
        return moving

    def show(self, number: int, state: State) -> None:
        """Make what moves that of the `number`-th state."""
        if self._field is not None:
            self._water.image = self._field.image(state)
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


def view_of(run: Run, outlines: Outlines) -> tuple[float, float, float, float]:
    """(x0, x1, y0, y1) in m: the fluid's domain, or what the bodies sweep and room around it."""
    if run.grid is not None:
        (x0, y0, _), (x1, y1, _) = run.grid.origin, run.grid.upper
        return x0, x1, y0, y1
    placed = [
        outline
        for state in run.sampled(SAMPLES)
        for outline in [*outlines.placed(state), *flesh_loops(run, state)]
    ]
    points = np.concatenate(placed) if placed else np.zeros((1, 2))
    points = points[np.isfinite(points).all(axis=1)]
    low, high = points.min(axis=0), points.max(axis=0)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    half = half + 0.6 * max(half.max(), 1e-6)
    half = np.maximum(half, 0.8 * half.max())
    return middle[0] - half[0], middle[0] + half[0], middle[1] - half[1], middle[1] + half[1]


def flesh_loops(run: Run, state: State) -> list[Array]:
    """Outlines (k, 2) of the flesh of a state, m; none when its numbers are lost."""
    if run.flesh is None or not np.isfinite(state["flesh_vertices"]).all():
        return []
    return skin_loops(state["flesh_vertices"].astype(float), run.flesh.triangles)


def _closed(loops: list[Array]) -> list[Path]:
    return [Path(np.concatenate([loop, loop[:1]]), closed=True) for loop in loops]


def wind_arrows(view: tuple[float, float, float, float], wind: Array) -> list[Array]:
    """Grid of arrows along `wind` (2,) over the map `view`, every other row shifted by half."""
    x0, x1, y0, y1 = view
    pitch = min(x1 - x0, y1 - y0) / WIND_ROWS
    vector = 0.42 * pitch * wind / np.hypot(*wind)
    arrows = []
    for row, y in enumerate(np.arange(y0 + 0.5 * pitch, y1, pitch)):
        for x in np.arange(x0 + (0.5 + 0.5 * (row % 2)) * pitch, x1, pitch):
            arrows.append(arrow(np.array([x, y]) - 0.5 * vector, vector, 0.035 * pitch))
    return arrows
