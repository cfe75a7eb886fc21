"""The picture of one frame of a run: fluid, bodies, forces and the curves of the run below them.

Whatever does not change from frame to frame is drawn once; a frame redraws only what moves.
"""

from __future__ import annotations

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backend_bases import RendererBase
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.patches import Rectangle
from numpy.typing import NDArray
from PIL import Image

from flowborne.view import style
from flowborne.view.arrows import arrow, round_number
from flowborne.view.fields import SAMPLES, field_of
from flowborne.view.layout import MARGIN, Layout
from flowborne.view.run import Run, State
from flowborne.view.strips import Strip, joint_curves, strip_curves

Array = NDArray[np.float64]

LONGEST_FORCE = 0.2
"""Length of the arrow of a large force, as a share of the map's smaller side."""

LARGE_FORCE = 90.0
"""Percentile over the frames of the largest force that counts as a large one."""

CUT_FORCE = 1.6
"""Longest arrow in lengths of that of a large force: where the jolt of a sudden start ends."""

SHAFT = 5.0
"""Width of the shaft of a force's arrow, pixels."""

SHORTEST = 3.0
"""Arrows shorter than this many pixels are left out."""

WIND_ROWS = 9
"""Rows of arrows that show a wind, along the map's smaller side."""

FIGURE_SPACE = "\u2007"
"""As wide as a digit, so that words stand still while their numbers change."""

NAMED = 3
"""Joints whose positions are written beside the time."""


class Water(Artist):
    """The fluid's small image, smoothly enlarged to fill its axes.

    matplotlib's own images say the same at five times the cost.

    image  (ny, nx, 3) colours, lowest row first
    """

    def __init__(self, axes: Axes) -> None:
        super().__init__()
        self.image = np.zeros((1, 1, 3), np.uint8)
        self._axes = axes
        self.set_animated(True)
        axes.add_artist(self)

    def draw(self, renderer: RendererBase) -> None:
        x0, y0, x1, y1 = (round(edge) for edge in self._axes.bbox.extents)
        small = Image.fromarray(np.ascontiguousarray(self.image[::-1]))
        large = small.resize((x1 - x0, y1 - y0), Image.Resampling.BICUBIC).convert("RGBA")
        # a cubic swings below its knots, which would show as black seams along dye
        darkest = np.append(self.image.min(axis=(0, 1)), np.uint8(255))
        pixels = np.maximum(np.asarray(large), darkest)[::-1]
        renderer.draw_image(renderer.new_gc(), x0, y0, pixels)


class Picture:
    """Draws the frames of a run, all on the same scales.

    layout  sizes at scale 1; a picture is `scale` times as large
    view    (x0, x1, y0, y1) of the map, m
    """

    def __init__(self, run: Run, scale: float = 1.0) -> None:
        self.run = run
        self._field = field_of(run)
        sampled = run.sampled(SAMPLES)
        self.view = view_of(run, sampled)
        x0, x1, y0, y1 = self.view
        curves = strip_curves(run)
        self.layout = Layout.of((y1 - y0) / (x1 - x0), len(curves))
        self._metres = (x1 - x0) / self.layout.map.width
        self._pushed = _pushed(run)
        self._large = _large_force(run, self._pushed)
        self._reach = LONGEST_FORCE * min(x1 - x0, y1 - y0)

        figure = self.layout.figure(scale)
        figure.patch.set_facecolor(style.PAPER)
        self._canvas = FigureCanvasAgg(figure)
        self._moving: list[Artist] = []
        self._draw_map(self.layout.axes(figure, self.layout.map))
        self._draw_legend(self.layout.axes(figure, self.layout.legend))
        self._draw_header()
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

    def draw(self, number: int) -> NDArray[np.uint8]:
        """(height, width, 4) picture of the `number`-th state, valid until the next call."""
        state = self.run.state(number)
        row = self.run.row(number)
        time = float(state["time"])
        if self._field is not None:
            self._water.image = self._field.image(state)
        self._bodies.set_verts(self.run.placed(state))
        self._forces.set_verts(self._arrows(state))
        self._clock.set_text(self._words(time, row))
        for strip in self._strips:
            strip.show(time, row)
        self._canvas.restore_region(self._still)
        for artist in self._moving:
            self._canvas.figure.draw_artist(artist)
        return np.asarray(self._canvas.buffer_rgba())

    def _draw_map(self, axes: Axes) -> None:
        """Make the artists of the map and draw what stands still in it."""
        x0, x1, y0, y1 = self.view
        axes.set(xlim=(x0, x1), ylim=(y0, y1), xticks=[], yticks=[], facecolor=style.WATER)
        for spine in axes.spines.values():
            spine.set_visible(False)
        if self._field is not None:
            self._water = Water(axes)
            self._moving.append(self._water)
        elif self.run.wind.any():
            arrows = wind_arrows(self.view, self.run.wind.sum(axis=0)[:2])
            axes.add_collection(PolyCollection(arrows, facecolors=style.WIND, edgecolors="none"))
        colours = [self._colour(body) for body in self.run.outline_body]
        self._bodies = PolyCollection(
            [], facecolors=colours, edgecolors=style.EDGE, linewidths=1.1, joinstyle="round"
        )
        self._forces = PolyCollection(
            [], facecolors=style.FORCE, edgecolors=style.EDGE, linewidths=0.8
        )
        for collection in (self._bodies, self._forces):
            collection.set_animated(True)
            axes.add_collection(collection)
            self._moving.append(collection)

    def _draw_header(self) -> None:
        figure, height = self._canvas.figure, self.layout.height
        left, right = MARGIN / self.layout.width, 1.0 - MARGIN / self.layout.width
        middle = 1.0 - 0.5 * self.layout.map.top / height
        figure.text(
            left,
            middle,
            self.run.name,
            color=style.TEXT,
            fontsize=15,
            weight="bold",
            va="center_baseline",
        )
        self._clock = figure.text(
            right,
            middle,
            "",
            color=style.TEXT,
            fontsize=11,
            ha="right",
            va="center_baseline",
            animated=True,
        )
        self._moving.append(self._clock)

    def _draw_legend(self, axes: Axes) -> None:
        """Scales of length, force and colour in a row below the map."""
        width, height = self.layout.legend.width, self.layout.legend.height
        axes.set(xlim=(0, width), ylim=(0, height))
        axes.axis("off")
        middle = 0.5 * height
        place = self._length_bar(axes, middle)
        if self._large > 0.0:
            place = self._force_key(axes, place, middle)
        if self._field is None:
            return
        for name, colour in self._field.legend:
            axes.plot(place + 6, middle, "o", ms=8, color=colour)
            place = _write(axes, place + 16, middle, name)
        if self._field.scale is not None:
            colours, low, high, name = self._field.scale
            left, right, half = width - 260, width - 60, 5
            axes.imshow(
                colours[None],
                extent=(left, right, middle - half, middle + half),
                aspect="auto",
                interpolation="bilinear",
            )
            axes.set(xlim=(0, width), ylim=(0, height))
            _write(axes, right + 8, middle, _signed(high))
            _write(axes, left - 8, middle, f"{name}   {_signed(low)}", "right")

    def _length_bar(self, axes: Axes, middle: float) -> float:
        """Draw a bar of a round length; the place behind it."""
        length = round_number(120.0 * self._metres)
        pixels = length / self._metres
        axes.add_patch(Rectangle((0, middle - 1.5), pixels, 3, color=style.MUTED, lw=0))
        return _write(axes, pixels + 8, middle, f"{length:g} m")

    def _force_key(self, axes: Axes, place: float, middle: float) -> float:
        """Draw the arrow of a round force; the place behind it."""
        force = round_number(self._large)
        pixels = force / self._large * self._reach / self._metres
        key = arrow(np.array([place, middle]), np.array([pixels, 0.0]), SHAFT)
        axes.add_collection(
            PolyCollection([key], facecolors=style.FORCE, edgecolors=style.EDGE, linewidths=0.8)
        )
        return _write(axes, place + pixels + 8, middle, f"{force:g} N/m")

    def _arrows(self, state: State) -> list[Array]:
        """Arrows of the forces on the bodies, in m of the map."""
        arrows = []
        for body in self._pushed if self._large > 0.0 else ():
            vector = self._reach / self._large * state["fluid_force"][body, :2].astype(float)
            length = float(np.hypot(*vector))
            if not SHORTEST * self._metres <= length < np.inf:
                continue
            vector *= min(1.0, CUT_FORCE * self._reach / length)
            centre = state["fluid_centre"][body, :2]
            arrows.append(arrow(centre, vector, SHAFT * self._metres))
        return arrows

    def _colour(self, body: int) -> str:
        if body == 0:
            return style.FIXED
        return style.ACCENT if body in self.run.accented else style.BODY

    def _words(self, time: float, row: int | None) -> str:
        """The time and the positions of the first joints, each of steady width."""
        words = []
        title, joints = joint_curves(self.run)
        unit, digits = ("°", 1) if "°" in title else (" m", 3)
        for name, values in list(joints.items())[:NAMED] if row is not None else ():
            number = f"{values[row]:+{digits + 5}.{digits}f}".replace(" ", FIGURE_SPACE)
            words.append(f"{name} {number.replace('-', '−')}{unit}")
        return (4 * FIGURE_SPACE).join([*words, f"t = {time:.2f} s"])


def view_of(run: Run, sampled: list[State]) -> tuple[float, float, float, float]:
    """(x0, x1, y0, y1) in m: the fluid's domain, or what the bodies sweep and room around it."""
    if run.grid is not None:
        (x0, y0, _), (x1, y1, _) = run.grid.origin, run.grid.upper
        return x0, x1, y0, y1
    placed = [outline for state in sampled for outline in run.placed(state)]
    points = np.concatenate(placed) if placed else np.zeros((1, 2))
    points = points[np.isfinite(points).all(axis=1)]
    low, high = points.min(axis=0), points.max(axis=0)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    half = half + 0.6 * max(half.max(), 1e-6)
    half = np.maximum(half, 0.8 * half.max())
    return middle[0] - half[0], middle[0] + half[0], middle[1] - half[1], middle[1] + half[1]


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


def _pushed(run: Run) -> tuple[int, ...]:
    """Bodies whose forces are shown: those that are drawn, the world's only when it is alone."""
    drawn = sorted(set(run.outline_body))
    return tuple(body for body in drawn if body > 0) or tuple(drawn)


def _large_force(run: Run, bodies: tuple[int, ...]) -> float:
    """Size of a large force of the film, N per unit depth; 0 when there is none."""
    if not bodies:
        return 0.0
    forces = run.every("fluid_force")[:, list(bodies), :2]
    sizes = np.hypot(forces[..., 0], forces[..., 1]).max(axis=1)
    finite = sizes[np.isfinite(sizes) & (sizes > 0.0)]
    return float(np.percentile(finite, LARGE_FORCE)) if finite.size else 0.0


def _signed(value: float) -> str:
    return f"{value:.2g}".replace("-", "−")


def _write(axes: Axes, x: float, y: float, words: str, align: str = "left") -> float:
    """Write into a legend; the place behind the words, with a gap."""
    text = axes.text(x, y, words, color=style.MUTED, fontsize=8.5, ha=align, va="center_baseline")
    right = text.get_window_extent().x1
    return float(axes.transData.inverted().transform((right, 0.0))[0]) + 26.0
