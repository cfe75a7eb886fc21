"""The picture of one frame of a run: fluid, bodies, forces, and curves below them.

What does not change from frame to frame is drawn once; a frame redraws only the rest.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.patches import Polygon
from matplotlib.patheffects import withStroke
from matplotlib.text import Text

from flowborne.kernels.arrays import Array, Pixels
from flowborne.view import style
from flowborne.view.glyphs import SHAFT_WIDTH, flat_arrows, round_number
from flowborne.view.layout import MARGIN, Box, Layout
from flowborne.view.maps import MapSlab
from flowborne.view.plots import (
    LETTERS_IN_LEGEND,
    Strip,
    joint_curves,
    shortened,
    signed,
    strip_curves,
)
from flowborne.view.run import Run
from flowborne.view.shot import Shot
from flowborne.view.space.opengl import import_renderer

if TYPE_CHECKING:
    from flowborne.view.space.stage import MapSpace

FIGURE_SPACE = "\u2007"
"""As wide as a digit, so that text does not move when its numbers change."""

MAX_BAR = 120.0
"""Maximum length of a scale bar, pixels."""

PLAIN_SIDE = 600.0
"""Smaller side of a map above which the text on it grows with it, pixels."""

NAMED_JOINTS = 3
"""Maximum number of joint positions that are written next to the time, if there is room."""

MIN_SCALE = 60
"""Minimum length of a colour scale, pixels of the layout."""


class Picture:
    """Draws the frames of a run, all on the same scales. Close it after use.

    raises  ValueError if the run has three dimensions and this machine cannot draw them

    layout  sizes at scale 1; a picture is `scale` times as large
    map     the part that shows the run itself
    """

    def __init__(self, run: Run, scale: float = 1.0, shot: Shot | None = None) -> None:
        """`shot`: what is shown; None is the shot of the run's scene."""
        self.run = run
        self.shot = shot = run.shot if shot is None else shot
        curves = strip_curves(run) if shot.plots else []
        if shot.size is not None:
            self.layout = Layout.sized(shot.size, len(curves), bare=not shot.plots)
            box = self.layout.map
            self.map = _map_of(run, shot, box.height / box.width)
        else:
            self.map = _map_of(run, shot)
            aspect = self.map.aspect
            self.layout = Layout.of(aspect, len(curves)) if shot.plots else Layout.bare(aspect)
        self._metres = self.map.width / self.layout.map.width

        figure = self.layout.figure(scale)
        figure.patch.set_facecolor("none" if shot.transparent else style.PAPER)
        self._canvas = FigureCanvasAgg(figure)
        axes = self.layout.axes(figure, self.layout.map)
        axes.set(xticks=[], yticks=[], facecolor="none" if shot.transparent else shot.colour)
        axes.spines[:].set_visible(False)
        self._moving = list(self.map.draw_on(axes, self.layout.map.width))
        self._clock: Text | None = None
        self._named = 0
        if shot.scale_bar and not shot.plots and not shot.transparent:
            self._moving += self._bar_on_map(self.layout.axes(figure, self.layout.map))
        if self.layout.legend is not None:
            self._draw_legend(self.layout.axes(figure, self.layout.legend), self.layout.legend)
            self._clock = self._draw_header()
            self._moving.append(self._clock)
        self._strips: list[Strip] = []
        for box, (title, named) in zip(self.layout.strips, curves, strict=True):
            strip = Strip(self.layout.axes(figure, box), title, run.history["time_s"], named)
            strip.axes.tick_params(labelbottom=box is self.layout.strips[-1])
            self._strips.append(strip)
            self._moving += strip.moving
        if self._strips:
            self._strips[-1].axes.set_xlabel("time (s)", fontsize=8, color=style.MUTED, labelpad=2)
        self._canvas.draw()
        self._still = self._canvas.copy_from_bbox(figure.bbox)

    def draw(self, number: int) -> Pixels:
        """(height, width, 4) picture of the `number`-th state, valid until the next call."""
        state = self.run.state(number)
        row = self.run.row(number)
        time = float(state["time"])
        self.map.show(number, state)
        if self._clock is not None:
            self._clock.set_text(self._words(time, row))
        for strip in self._strips:
            strip.show(time, row)
        self._canvas.restore_region(self._still)
        for artist in self._moving:
            self._canvas.figure.draw_artist(artist)
        return np.asarray(self._canvas.buffer_rgba())

    def close(self) -> None:
        """Release the resources of the map."""
        self.map.close()

    def _draw_header(self) -> Text:
        """Write the name of the run; returns the text of the time, which changes in every frame."""
        figure, height = self._canvas.figure, self.layout.height
        left, right = MARGIN / self.layout.width, 1.0 - MARGIN / self.layout.width
        middle = 1.0 - 0.5 * self.layout.map.top / height
        drawn = {"color": style.TEXT, "va": "center_baseline"}
        title = figure.text(left, middle, self.run.name, fontsize=15, weight="bold", **drawn)
        clock = figure.text(right, middle, "", fontsize=11, ha="right", animated=True, **drawn)
        first = 0 if len(self.run.history["frame"]) else None
        for self._named in range(NAMED_JOINTS, -1, -1):
            clock.set_text(self._words(0.0, first))
            if clock.get_window_extent().x0 > title.get_window_extent().x1 + MARGIN:
                break
        return clock

    def _draw_legend(self, axes: Axes, box: Box) -> None:
        width, height = box.width, box.height
        axes.set(xlim=(0, width), ylim=(0, height))
        axes.axis("off")
        middle, x = 0.5 * height, 0.0
        if self.shot.scale_bar:
            length, pixels = self._bar(MAX_BAR)
            bar = _bar_outline(0.0, middle, pixels, 1.0)
            axes.add_patch(Polygon(bar, color=style.MUTED, lw=0))
            x = _write(axes, pixels + 8, middle, f"{length:g} m")
        if self.map.forces.large > 0.0:
            x = self._force_key(axes, x, middle)
        for name, colour in self.map.legend:
            axes.plot(x + 6, middle, "o", ms=8, color=colour)
            x = _write(axes, x + 16, middle, name)
        if self.map.scale is not None:
            colours, low, high, name = self.map.scale
            words = f"{name}   {signed(low)}"
            right, half = width - 60, 5
            left = min(max(width - 260, x + _width(axes, words) + 8), right - MIN_SCALE)
            axes.imshow(
                colours[None],
                extent=(left, right, middle - half, middle + half),
                aspect="auto",
                interpolation="bilinear",
            )
            axes.set(xlim=(0, width), ylim=(0, height))
            _write(axes, right + 8, middle, signed(high))
            _write(axes, left - 8, middle, words, "right")

    def _bar(self, most: float) -> tuple[float, float]:
        """Length of a bar in m, a round number, and in pixels of the layout, at most `most`."""
        length = round_number(most * self._metres)
        return length, length / self._metres

    def _bar_on_map(self, axes: Axes) -> list[Artist]:
        """Draw a scale bar in the lower left corner of a map that fills the picture, in `axes` over
        it; returns its artists."""
        box = self.layout.map
        axes.set(xlim=(0, box.width), ylim=(0, box.height))
        axes.axis("off")
        size = max(1.0, min(box.width, box.height) / PLAIN_SIDE)
        length, pixels = self._bar(min(MAX_BAR * size, 0.25 * box.width))
        edge = [withStroke(linewidth=2.4 * size, foreground=style.EDGE, alpha=0.6)]
        left = bottom = 22.0 * size
        bar = Polygon(
            _bar_outline(left, bottom, pixels, size), color=style.TEXT, lw=0, path_effects=edge
        )
        text = axes.text(
            left + pixels + 9.0 * size,
            bottom,
            f"{length:g} m",
            color=style.TEXT,
            fontsize=9.0 * size,
            va="center_baseline",
            path_effects=edge,
        )
        artists: list[Artist] = [axes.add_patch(bar), text]
        for artist in artists:
            artist.set_animated(True)
        return artists

    def _force_key(self, axes: Axes, x: float, middle: float) -> float:
        """Draw the arrow of a round force; returns x of the next item."""
        forces = self.map.forces
        force = round_number(forces.large)
        pixels = force / forces.large * forces.reach / self._metres
        key = flat_arrows(np.array([x, middle]), np.array([pixels, 0.0]), SHAFT_WIDTH)
        axes.add_collection(
            PolyCollection([key], facecolors=style.FORCE, edgecolors=style.EDGE, linewidths=0.8)
        )
        return _write(axes, x + pixels + 8, middle, f"{force:,.12g} {forces.unit}")

    def _words(self, time: float, row: int | None) -> str:
        """The time and the positions of the first joints, each of constant width."""
        words = []
        title, joints = joint_curves(self.run)
        unit, digits = ("°", 1) if "°" in title else (" m", 3)
        for name, values in list(joints.items())[: self._named] if row is not None else ():
            number = f"{values[row]:+{digits + 5}.{digits}f}".replace(" ", FIGURE_SPACE)
            words.append(
                f"{shortened(name, LETTERS_IN_LEGEND // 5)} {number.replace('-', '−')}{unit}"
            )
        return (4 * FIGURE_SPACE).join([*words, f"t = {time:.2f} s"])


def _map_of(run: Run, shot: Shot, aspect: float | None = None) -> MapSlab | MapSpace:
    if run.is_slab:
        return MapSlab(run, shot, aspect)
    import_renderer()
    from flowborne.view.space.stage import MapSpace

    return MapSpace(run, shot, aspect)


def _bar_outline(left: float, middle: float, pixels: float, size: float) -> Array:
    """(12, 2) outline of a bar with ticks at its ends."""
    thin, tick, right = 1.0 * size, 4.5 * size, left + pixels
    inner, outer = (left + 2.0 * size, right - 2.0 * size), (left, right)
    x = [outer[0], inner[0], inner[0], inner[1], inner[1], outer[1]]
    y = [tick, tick, thin, thin, tick, tick]
    upper = np.column_stack([x, y])
    return np.concatenate([upper, upper[::-1] * [1.0, -1.0]]) + np.array([0.0, middle])


def _width(axes: Axes, words: str) -> float:
    text = axes.text(0.0, 0.0, words, fontsize=8.5)
    box = text.get_window_extent().transformed(axes.transData.inverted())
    text.remove()
    return float(box.width)


def _write(axes: Axes, x: float, y: float, words: str, align: str = "left") -> float:
    """Write into a legend; returns x of the next item."""
    text = axes.text(x, y, words, color=style.MUTED, fontsize=8.5, ha=align, va="center_baseline")
    right = text.get_window_extent().x1
    return float(axes.transData.inverted().transform((right, 0.0))[0]) + 26.0
