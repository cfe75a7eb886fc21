"""An image in a map."""

from __future__ import annotations

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backend_bases import RendererBase
from PIL import Image


class MapImage(Artist):
    """An image, smoothly enlarged to fill its part of the map; drawn anew in every frame.

    matplotlib's own images say the same at five times the cost.

    image  (ny, nx, 3 or 4) colours, lowest row first
    """

    def __init__(self, axes: Axes, extent: tuple[float, float, float, float] | None = None) -> None:
        """`extent`: (x0, x1, y0, y1) of the image on the axes; all of them when None."""
        super().__init__()
        self.image = np.zeros((1, 1, 3), np.uint8)
        self._axes = axes
        self._extent = extent
        self.set_animated(True)
        axes.add_artist(self)

    @property
    def pixels(self) -> tuple[int, int]:
        """Width and height of the axes on the canvas."""
        x0, y0, x1, y1 = self._edges()
        return x1 - x0, y1 - y0

    def draw(self, renderer: RendererBase) -> None:
        seen = self._seen()
        if seen is None:
            return
        (x0, y0, width, height), part = seen
        small = Image.fromarray(np.ascontiguousarray(self.image[::-1]))
        sized = small.resize((width, height), Image.Resampling.BICUBIC, box=part)
        pixels = np.asarray(sized.convert("RGBA"))
        if small.size != (width, height) and self.image.shape[-1] == 3:
            # a cubic swings below its knots, which would show as black seams along dye
            darkest = np.append(self.image.min(axis=(0, 1)), np.uint8(255))
            pixels = np.maximum(pixels, darkest)
        renderer.draw_image(renderer.new_gc(), x0, y0, pixels[::-1])

    def _seen(
        self,
    ) -> tuple[tuple[int, int, int, int], tuple[float, float, float, float]] | None:
        """Where on the canvas the image is seen (left, bottom, width, height), and what part of it
        (left, upper, right, lower) in its own pixels; None when it is not on the map."""
        left, bottom, right, top = self._edges()
        rows, columns = self.image.shape[:2]
        if self._extent is None:
            return (left, bottom, right - left, top - bottom), (0.0, 0.0, columns, rows)
        x0, x1, y0, y1 = self._extent
        (low, high), (lower, upper) = self._axes.get_xlim(), self._axes.get_ylim()
        across, along = (right - left) / (high - low), (top - bottom) / (upper - lower)
        first = np.round([left + across * (x0 - low), bottom + along * (y0 - lower)]).astype(int)
        last = np.round([left + across * (x1 - low), bottom + along * (y1 - lower)]).astype(int)
        begin = np.maximum(first, [left, bottom])
        end = np.minimum(last, [right, top])
        if (end <= begin).any():
            return None
        share = np.array([columns, rows]) / (last - first)
        (a, b), (c, d) = (begin - first) * share, (end - first) * share
        size = end - begin
        place = (int(begin[0]), int(begin[1]), int(size[0]), int(size[1]))
        return place, (float(a), float(rows - d), float(c), float(rows - b))

    def _edges(self) -> tuple[int, int, int, int]:
        x0, y0, x1, y1 = (round(edge) for edge in self._axes.bbox.extents)
        return x0, y0, x1, y1
