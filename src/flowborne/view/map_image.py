"""An image that fills a map."""

from __future__ import annotations

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backend_bases import RendererBase
from PIL import Image


class MapImage(Artist):
    """An image, smoothly enlarged to fill its axes; drawn anew in every frame.

    matplotlib's own images say the same at five times the cost.

    image  (ny, nx, 3) colours, lowest row first
    """

    def __init__(self, axes: Axes) -> None:
        super().__init__()
        self.image = np.zeros((1, 1, 3), np.uint8)
        self._axes = axes
        self.set_animated(True)
        axes.add_artist(self)

    @property
    def pixels(self) -> tuple[int, int]:
        """Width and height of the axes on the canvas."""
        x0, y0, x1, y1 = self._edges()
        return x1 - x0, y1 - y0

    def draw(self, renderer: RendererBase) -> None:
        x0, y0, *_ = self._edges()
        small = Image.fromarray(np.ascontiguousarray(self.image[::-1]))
        pixels = np.asarray(small.resize(self.pixels, Image.Resampling.BICUBIC).convert("RGBA"))
        if small.size != self.pixels:
            # a cubic swings below its knots, which would show as black seams along dye
            darkest = np.append(self.image.min(axis=(0, 1)), np.uint8(255))
            pixels = np.maximum(pixels, darkest)
        renderer.draw_image(renderer.new_gc(), x0, y0, pixels[::-1])

    def _edges(self) -> tuple[int, int, int, int]:
        x0, y0, x1, y1 = (round(edge) for edge in self._axes.bbox.extents)
        return x0, y0, x1, y1
