"""Where the parts of a picture stand, in pixels at scale 1."""

from __future__ import annotations

from dataclasses import dataclass

from matplotlib.axes import Axes
from matplotlib.figure import Figure

MARGIN, HEADER, LEGEND, STRIP, STRIP_GAP, FOOTER = 28, 56, 46, 78, 30, 40
"""Margin at the sides, and heights of the parts."""

NUMBERS = 44
"""Room left of the strips for their numbers."""

MAP_WIDTH, MAP_HEIGHT, LEAST_WIDTH = 904, 780, 640
"""Largest sides of the map, and least width of the picture."""

DOTS = 100
"""Pixels per inch, an inch being matplotlib's 72 points."""


@dataclass(frozen=True)
class Box:
    """Rectangle in pixels from the upper left corner of the picture."""

    left: int
    top: int
    width: int
    height: int


@dataclass(frozen=True)
class Layout:
    """Even size of the picture, and its parts."""

    width: int
    height: int
    map: Box
    legend: Box
    strips: tuple[Box, ...]

    @classmethod
    def of(cls, aspect: float, strips: int) -> Layout:
        """Layout with a map that is `aspect` times as high as wide above so many strips."""
        map_width = round(min(MAP_WIDTH, MAP_HEIGHT / aspect))
        map_height = max(round(aspect * map_width), 2)
        width = _even(max(map_width + 2 * MARGIN, LEAST_WIDTH))
        inner = width - 2 * MARGIN
        below = HEADER + map_height
        top = below + LEGEND + 20
        boxes = tuple(
            Box(MARGIN + NUMBERS, top + n * (STRIP + STRIP_GAP), inner - NUMBERS, STRIP)
            for n in range(strips)
        )
        foot = boxes[-1].top + STRIP + FOOTER if boxes else below + LEGEND
        return cls(
            width=width,
            height=_even(foot),
            map=Box((width - map_width) // 2, HEADER, map_width, map_height),
            legend=Box(MARGIN, below, inner, LEGEND),
            strips=boxes,
        )

    def figure(self, scale: float) -> Figure:
        """Empty figure of this size times `scale`."""
        inches = (_inches(self.width), _inches(self.height))
        return Figure(figsize=inches, dpi=DOTS * scale)

    def axes(self, figure: Figure, box: Box) -> Axes:
        """New axes at `box`."""
        bottom = self.height - box.top - box.height
        return figure.add_axes(
            (
                box.left / self.width,
                bottom / self.height,
                box.width / self.width,
                box.height / self.height,
            )
        )


def _even(length: int) -> int:
    return length + length % 2


def _inches(pixels: int) -> float:
    """A little more than the length, because a canvas cuts fractions of pixels off."""
    return (pixels + 0.01) / DOTS
