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

WIDE, WIDE_WIDTH, BESIDE = 1.25, 1440, 0.62
"""Width over height from which on strips stand beside the map; then the width of the picture, and
the map's part of it."""

HIGHEST_STRIP = 260
"""Height of a strip beside the map at most."""

LEAST_MAP = 120
"""Least height of a map above its strips."""

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
    """Size of the picture, even at its own scale, and its parts; those that are None are absent.

    scale  pixels of the picture in one of the layout
    """

    width: float
    height: float
    map: Box
    legend: Box | None
    strips: tuple[Box, ...]
    scale: float = 1.0

    @classmethod
    def of(cls, aspect: float, strips: int) -> Layout:
        """Layout with a map that is `aspect` times as high as wide above so many strips."""
        map_width, map_height = _map_sides(aspect)
        width = _even(max(map_width + 2 * MARGIN, LEAST_WIDTH))
        inner = width - 2 * MARGIN
        below = HEADER + map_height
        boxes = _stacked(MARGIN, below + LEGEND + 20, inner, strips)
        foot = boxes[-1].top + STRIP + FOOTER if boxes else below + LEGEND
        return cls(
            width=width,
            height=_even(foot),
            map=Box((width - map_width) // 2, HEADER, map_width, map_height),
            legend=Box(MARGIN, below, inner, LEGEND),
            strips=boxes,
        )

    @classmethod
    def bare(cls, aspect: float) -> Layout:
        """Layout of a map alone."""
        width, height = (_even(side) for side in _map_sides(aspect))
        return cls(width, height, Box(0, 0, width, height), None, ())

    @classmethod
    def sized(cls, size: tuple[int, int], strips: int, *, bare: bool) -> Layout:
        """Layout of a picture of `size` pixels, strips beside the map where it is wide.

        bare    the map alone
        raises  ValueError when the size leaves the map no room
        """
        if bare:
            return cls(*size, Box(0, 0, *size), None, ())
        wide = strips > 0 and size[0] > WIDE * size[1]
        width = WIDE_WIDTH if wide else MAP_WIDTH + 2 * MARGIN
        scale = size[0] / width
        height = size[1] / scale
        inner = width - 2 * MARGIN
        if wide:
            map_width, map_height = round(BESIDE * inner), int(height) - HEADER - LEGEND
            left = MARGIN + map_width + 20
            each = min((map_height - 20) // strips - STRIP_GAP, HIGHEST_STRIP)
            boxes = _stacked(left, HEADER + 20, width - MARGIN - left, strips, each)
            cramped = each < STRIP // 2
        else:
            foot = 20 + strips * (STRIP + STRIP_GAP) + FOOTER - STRIP_GAP if strips else 0
            map_width, map_height = inner, int(height) - HEADER - LEGEND - foot
            boxes = _stacked(MARGIN, HEADER + map_height + LEGEND + 20, inner, strips)
            cramped = False
        if map_height < LEAST_MAP or cramped:
            raise ValueError(
                f"a picture of {size[0]} by {size[1]} pixels has no room for its plots; make it "
                "higher, or drop them with plots=false"
            )
        map_box = Box(MARGIN, HEADER, map_width, map_height)
        legend = Box(MARGIN, HEADER + map_height, inner, LEGEND)
        return cls(width, height, map_box, legend, boxes, scale)

    def figure(self, scale: float) -> Figure:
        """Empty figure of this size times `scale`."""
        dots = DOTS * scale * self.scale
        width, height = (side * self.scale * scale for side in (self.width, self.height))
        # a little more than the length, because a canvas cuts fractions of pixels off
        inches = ((round(width) + 0.01) / dots, (round(height) + 0.01) / dots)
        return Figure(figsize=inches, dpi=dots)

    @property
    def pixels(self) -> tuple[int, int]:
        """Width and height of the picture."""
        return round(self.width * self.scale), round(self.height * self.scale)

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


def _map_sides(aspect: float) -> tuple[int, int]:
    width = round(min(MAP_WIDTH, MAP_HEIGHT / aspect))
    return width, max(round(aspect * width), 2)


def _stacked(left: int, top: int, width: int, strips: int, height: int = STRIP) -> tuple[Box, ...]:
    """Strips one below the other, room for their numbers on their left."""
    return tuple(
        Box(left + NUMBERS, top + n * (height + STRIP_GAP), width - NUMBERS, height)
        for n in range(strips)
    )


def _even(length: int) -> int:
    return length + length % 2
