"""The map of a picture, which shows the run itself, of a slab; it is seen from above."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backend_bases import RendererBase
from matplotlib.collections import LineCollection, PathCollection, PolyCollection
from matplotlib.path import Path
from PIL import Image

from flowborne.kernels.arrays import Array
from flowborne.view import style
from flowborne.view.fields import FieldVortices, faded, field_of, over
from flowborne.view.framing import windows
from flowborne.view.glyphs import SHAFT_WIDTH, Forces, camera_moves, crosses, flat_arrows
from flowborne.view.outlines import Outlines, flesh_loops
from flowborne.view.run import Run, State
from flowborne.view.shot import Shot

ROUNDING = 1e-6
"""Share of a pixel that an image may lack and still fills it."""

WIND_ROWS = 9
"""Rows of arrows that show a wind, along the map's smaller side."""


class MapImage(Artist):
    """An image, smoothly enlarged to fill its part of the map; redrawn in every frame.

    It takes a fifth of the time of matplotlib's own images.

    image   (ny, nx, 3 or 4) colours, lowest row first
    extent  (x0, x1, y0, y1) of the image on the axes; None fills them
    """

    def __init__(self, axes: Axes) -> None:
        super().__init__()
        self.image = np.zeros((1, 1, 3), np.uint8)
        self._axes = axes
        self.extent: tuple[float, float, float, float] | None = None
        self.set_animated(True)
        axes.add_artist(self)

    @property
    def pixels(self) -> tuple[int, int]:
        """Width and height of the axes on the canvas."""
        x0, y0, x1, y1 = self._edges()
        return x1 - x0, y1 - y0

    def draw(self, renderer: RendererBase) -> None:
        found = self._on_canvas()
        if found is None:
            return
        (x0, y0, width, height), part = found
        small = Image.fromarray(np.ascontiguousarray(self.image[::-1]))
        sized = small.resize((width, height), Image.Resampling.BICUBIC, box=part)
        pixels = np.asarray(sized.convert("RGBA"))
        if small.size != (width, height) and self.image.shape[-1] == 3:
            # cubics undershoot, which would show as black seams along dye
            darkest = np.append(self.image.min(axis=(0, 1)), np.uint8(255))
            pixels = np.maximum(pixels, darkest)
        renderer.draw_image(renderer.new_gc(), x0, y0, pixels[::-1])

    def _on_canvas(
        self,
    ) -> tuple[tuple[int, int, int, int], tuple[float, float, float, float]] | None:
        """Box of the image on the canvas (left, bottom, width, height), and the part of it there
        (left, upper, right, lower) in its own pixels; None if it is not on the map."""
        left, bottom, right, top = self._edges()
        rows, columns = self.image.shape[:2]
        if self.extent is None:
            return (left, bottom, right - left, top - bottom), (0.0, 0.0, columns, rows)
        x0, x1, y0, y1 = self.extent
        (low, high), (lower, upper) = self._axes.get_xlim(), self._axes.get_ylim()
        across, along = (right - left) / (high - low), (top - bottom) / (upper - lower)
        first = np.array([left + across * (x0 - low), bottom + along * (y0 - lower)])
        last = np.array([left + across * (x1 - low), bottom + along * (y1 - lower)])
        begin = np.maximum(np.ceil(first - ROUNDING).astype(int), [left, bottom])
        end = np.minimum(np.floor(last + ROUNDING).astype(int), [right, top])
        if (end <= begin).any():
            return None
        whole = np.array([columns, rows])
        share = whole / (last - first)
        # pixels are whole, the part of the image is not, so that a slow motion is smooth; Pillow
        # refuses a part beyond the image
        a, b = np.clip((begin - first) * share, 0.0, whole)
        c, d = np.clip((end - first) * share, 0.0, whole)
        size = end - begin
        box = (int(begin[0]), int(begin[1]), int(size[0]), int(size[1]))
        return box, (float(a), float(rows - d), float(c), float(rows - b))

    def _edges(self) -> tuple[int, int, int, int]:
        x0, y0, x1, y1 = (round(edge) for edge in self._axes.bbox.extents)
        return x0, y0, x1, y1


class MapSlab:
    """Map of a slab from above: its fluid, its bodies and the forces on them.

    views   (frames, 4) m, (x0, x1, y0, y1) of each frame
    width   m across the map
    aspect  height over width
    forces  the scale of the arrows of forces
    """

    def __init__(self, run: Run, shot: Shot, aspect: float | None = None) -> None:
        """`aspect`: required height over width of the map, if any."""
        self.run = run
        self._shot = shot
        self._shown = [n for n, geom in enumerate(run.geoms) if shot.bones or not geom.covered]
        field = field_of(run, shot)
        assert not isinstance(field, FieldVortices)
        self._field = field
        self._outlines = Outlines(run)
        self.views = windows(run, shot, aspect)
        x0, x1, y0, y1 = self.views[0]
        self.width = float(x1 - x0)
        self.aspect = float((y1 - y0) / (x1 - x0))
        self._side = float(min(x1 - x0, y1 - y0))
        self._faded = faded_axes(run, self.views)
        self.forces = Forces(run, self._side)
        self.legend = () if self._field is None else self._field.legend
        self.scale = None if self._field is None else self._field.scale

    def draw_on(self, axes: Axes, pixels: int) -> Sequence[Artist]:
        """Draw what is fixed in `axes`, `pixels` wide at scale 1; returns the moving artists."""
        self._pixel = self.width / pixels
        self._axes = axes
        self._look(0)
        moving: list[Artist] = []
        self._wind = PolyCollection([], facecolors=style.WIND, edgecolors="none", animated=True)
        if self._field is not None:
            self._water = MapImage(axes)
            moving.append(self._water)
        elif self.run.grid is None and self.run.wind.any():
            axes.add_collection(self._wind)
            moving.append(self._wind)
        self._marks: LineCollection | None = None
        if camera_moves(self.views, self._side) and not self._shot.transparent:
            self._marks = LineCollection([], colors=style.MOTES, linewidths=1.0, animated=True)
            axes.add_collection(self._marks)
            moving.append(self._marks)
        bodies = [self.run.geoms[n].body for n in self._shown]
        colours = [style.body_colour(body, self.run.accented) for body in bodies]
        edged: dict[str, Any] = {"edgecolors": style.EDGE, "linewidths": 1.1, "joinstyle": "round"}
        self._bodies = PolyCollection([], facecolors=colours, **edged)
        # flesh below bones is as dark as if they were seen through it, but hides the fluid
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
        """Update the moving artists to the `number`-th state."""
        self._look(number)
        if self._field is not None:
            image, grid = self._field.image(state), self.run.grid_at(state)
            if self._faded:
                image = faded(image, self._faded)
            (x0, y0, _), (x1, y1, _) = grid.origin, grid.upper
            self._water.image = image if self._shot.transparent else over(image, self._shot.colour)
            self._water.extent = (x0, x1, y0, y1)
        elif self.run.grid is None and self.run.wind.any():
            corner, wind = self.views[0, [0, 2]], self.run.wind.sum(axis=0)[:2]
            self._wind.set_verts(list(wind_arrows(self.views[number], corner, wind)))
        if self._marks is not None:
            x0, x1, y0, y1 = self.views[number]
            self._marks.set_segments(
                list(crosses(np.array([x0, y0]), np.array([x1, y1]), self._side))
            )
        outlines = self._outlines.placed(state)
        self._bodies.set_verts([outlines[n] for n in self._shown])
        loops = flesh_loops(self.run, state)
        # one path of all loops, so that holes in the flesh stay empty
        closed = [Path(np.concatenate([loop, loop[:1]]), closed=True) for loop in loops]
        self._flesh.set_paths([Path.make_compound_path(*closed)] if loops else [])
        width = SHAFT_WIDTH * self._pixel
        arrows = self.forces.arrows(state, self._pixel)
        self._arrows.set_verts([flat_arrows(tail, vector, width) for _, tail, vector in arrows])

    def close(self) -> None:
        """A slab has no resources to release."""

    def _look(self, number: int) -> None:
        x0, x1, y0, y1 = self.views[number]
        self._axes.set(xlim=(x0, x1), ylim=(y0, y1))


def faded_axes(run: Run, views: Array) -> tuple[int, ...]:
    """Axes along which the domain follows bodies and views (frames, 4) reach beyond it, m."""
    if not run.window_axes:
        return ()
    low, grid = run.origins(), run.grid_at({})
    high = low + grid.spacing * np.array(grid.shape)
    slack = 1e-6 * grid.spacing
    return tuple(
        axis
        for axis in run.window_axes
        if (views[:, 2 * axis] < low[:, axis] - slack).any()
        or (views[:, 2 * axis + 1] > high[:, axis] + slack).any()
    )


def wind_arrows(view: Array, corner: Array, wind: Array) -> Array:
    """(n, 7, 2) grid of arrows along `wind` (2,) in the window `view`.

    The grid is fixed in the world; its odd rows are shifted by half.

    corner  (2,) m, of its lower left square
    """
    x0, x1, y0, y1 = view
    spacing = min(x1 - x0, y1 - y0) / WIND_ROWS
    vector = 0.42 * spacing * wind / np.hypot(*wind)
    first = np.floor((np.array([x0, y0]) - corner) / spacing + 1e-6).astype(int)
    last = np.ceil((np.array([x1, y1]) - corner) / spacing - 1e-6).astype(int)
    columns, rows = (np.arange(a, b) for a, b in zip(first, last, strict=True))
    j, i = (index.ravel() for index in np.meshgrid(rows, columns, indexing="ij"))
    middle = corner + spacing * (np.stack([i + 0.5 * (j % 2), j], axis=1) + 0.5)
    return flat_arrows(middle - 0.5 * vector, vector, 0.035 * spacing)
