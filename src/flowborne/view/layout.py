"""The layout of a picture: boxes of its parts, in pixels at scale 1."""

from __future__ import annotations

from dataclasses import dataclass

from matplotlib.axes import Axes
from matplotlib.figure import Figure

MARGIN, HEADER, LEGEND, STRIP, STRIP_GAP, FOOTER = 28, 56, 46, 78, 30, 40
"""Margin at the sides, and heights of the parts."""

STRIP_NUMBERS = 44
"""Width of the numbers to the left of the strips."""

MAP_WIDTH, MAP_HEIGHT, MIN_WIDTH = 904, 780, 640
"""Maximum width and height of the map, and minimum width of the picture."""

WIDE, WIDE_WIDTH, WIDE_MAP = 1.25, 1440, 0.62
"""Width over height above which strips are to the right of the map; then the width of the picture,
and the map's share of it."""

MAX_STRIP = 260
"""Maximum height of a strip to the right of the map."""

MIN_MAP = 120
"""Minimum height of a map above its strips."""

DPI = 100
"""Pixels per inch (72 points of matplotlib)."""


@dataclass(frozen=True)
class Box:
    """Rectangle in pixels, from the upper left corner of the picture."""

    left: int
    top: int
    width: int
    height: int


@dataclass(frozen=True)
class Layout:
    """Size of the picture, even at its own scale, and its parts; absent ones are None.

    scale  pixels of the picture per pixel of the layout
    """

    width: float
    height: float
    map: Box
    legend: Box | None
    strips: tuple[Box, ...]
    scale: float = 1.0

    @classmethod
    def of(cls, aspect: float, strips: int) -> Layout:
        """Layout of a map of height over width `aspect` above a number of strips."""
        map_width, map_height = _map_sides(aspect)
        width = _even(max(map_width + 2 * MARGIN, MIN_WIDTH))
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
    def sized(cls, size: tuple[int, ...], strips: int, *, bare: bool) -> Layout:
        """Layout of a picture of `size` pixels; if it is wide, strips are to the right of the map.

        bare    the map alone
        raises  ValueError if the size is too small for the map and its strips
        """
        across, down = size
        if bare:
            return cls(across, down, Box(0, 0, across, down), None, ())
        wide = strips > 0 and across > WIDE * down
        width = WIDE_WIDTH if wide else MAP_WIDTH + 2 * MARGIN
        scale = across / width
        height = down / scale
        inner = width - 2 * MARGIN
        if wide:
            map_width, map_height = round(WIDE_MAP * inner), int(height) - HEADER - LEGEND
            left = MARGIN + map_width + 20
            each = min((map_height - 20) // strips - STRIP_GAP, MAX_STRIP)
            boxes = _stacked(left, HEADER + 20, width - MARGIN - left, strips, each)
            cramped = each < STRIP // 2
        else:
            foot = 20 + strips * (STRIP + STRIP_GAP) + FOOTER - STRIP_GAP if strips else 0
            map_width, map_height = inner, int(height) - HEADER - LEGEND - foot
            boxes = _stacked(MARGIN, HEADER + map_height + LEGEND + 20, inner, strips)
            cramped = False
        if map_height < MIN_MAP or cramped:
            raise ValueError(
                f"a picture of {across} by {down} pixels has no room for its plots; make it "
                "higher, or drop them with plots=false"
            )
        map_box = Box(MARGIN, HEADER, map_width, map_height)
        legend = Box(MARGIN, HEADER + map_height, inner, LEGEND)
        return cls(width, height, map_box, legend, boxes, scale)

    def figure(self, scale: float) -> Figure:
        """Empty figure of this size times `scale`."""
        dots = DPI * scale * self.scale
        width, height = (side * self.scale * scale for side in (self.width, self.height))
        # a little more than the length, because a canvas truncates fractions of pixels
        inches = ((round(width) + 0.01) / dots, (round(height) + 0.01) / dots)
        return Figure(figsize=inches, dpi=dots)

    def axes(self, figure: Figure, box: Box) -> Axes:
        """New axes at `box`."""
        bottom = self.height - box.top - box.height
        left, width = box.left / self.width, box.width / self.width
        return figure.add_axes((left, bottom / self.height, width, box.height / self.height))


def _map_sides(aspect: float) -> tuple[int, int]:
    width = round(min(MAP_WIDTH, MAP_HEIGHT / aspect))
    return width, max(round(aspect * width), 2)


def _stacked(left: int, top: int, width: int, strips: int, height: int = STRIP) -> tuple[Box, ...]:
    """A column of strips, with space for their numbers on the left."""
    return tuple(
        Box(left + STRIP_NUMBERS, top + n * (height + STRIP_GAP), width - STRIP_NUMBERS, height)
        for n in range(strips)
    )


def _even(length: int) -> int:
    return length + length % 2
