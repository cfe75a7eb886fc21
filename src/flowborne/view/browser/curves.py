"""The curves of a run beside the scene: all of the run faintly, what is past brightly."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from flowborne.view import style
from flowborne.view.run import Run
from flowborne.view.strips import robust_limits, strip_curves

if TYPE_CHECKING:
    from viser import GuiApi

Array = NDArray[np.float64]

SAMPLES = 400
"""Times of a curve that are sent at most: about a pixel each."""

CHARACTER_WIDTH, AXIS_MARGIN = 6.6, 16
"""Pixels of a character of a number at an axis, and of all else between numbers and plot."""

LEAST_AXIS_WIDTH = 58
"""Pixels for numbers at an axis at least: plots one below the other begin at the same x."""

HEIGHT = 150
"""Of a plot, pixels."""


class Curves:
    """The plots of a run, of the titles and curves that its film has."""

    def __init__(self, gui: GuiApi, run: Run) -> None:
        self._gui = gui
        self._shown: list[Any] = []
        self.extend(run)

    def extend(self, run: Run) -> None:
        """Take the curves of a run that has come farther."""
        for shown in self._shown:
            shown.remove()
        times = run.history["time_s"]
        chosen = np.unique(np.linspace(0, len(times) - 1, SAMPLES).round().astype(int))
        self._shown, self._values, self.plots = [], [], []
        if not len(times):
            return
        self._times = times[chosen]
        for title, curves in strip_curves(run):
            values = np.stack([curve[chosen] for curve in curves.values()])
            names = self._gui.add_html(_title(title, list(curves)))
            plot = self._gui.add_uplot(
                self._data(values, 0.0),
                _series(len(curves)),
                scales={"x": {"time": False}, "y": {"range": robust_limits(values)}},
                axes=(_axis(34, "time (s)"), _axis(room_for(*robust_limits(values)))),
                padding=(8, 16, 0, 0),
                legend={"show": False},
                height=HEIGHT,
            )
            self._shown += [names, plot]
            self._values.append(values)
            self.plots.append(plot)

    def show(self, time: float) -> None:
        """Show what is past at a time, s."""
        for plot, values in zip(self.plots, self._values, strict=True):
            plot.data = self._data(values, time)

    def _data(self, values: Array, time: float) -> tuple[Array, ...]:
        """Times, every curve of values (k, n), and each again as far as it is past."""
        past = np.where(self._times <= time + 1e-9, values, np.nan)
        return (self._times, *values, *past)


def _title(title: str, names: Sequence[str]) -> str:
    """Title of a plot, and the names of its curves in their colours."""
    named = [
        f'<span style="color:{_colour(n)};margin-left:10px">{escape(name)}</span>'
        for n, name in enumerate(names)
    ]
    return (
        '<div style="padding:6px 12px 0;font-size:13px;line-height:1.3">'
        f"{escape(title)}{''.join(named)}</div>"
    )


def _series(count: int) -> tuple[Any, ...]:
    """How the times and so many curves are drawn, whole and past."""
    points = {"show": False}
    whole = [{"stroke": f"{_colour(n)}50", "width": 1.2, "points": points} for n in range(count)]
    past = [{"stroke": _colour(n), "width": 2.2, "points": points} for n in range(count)]
    return ({"label": "time (s)"}, *whole, *past)


def _colour(curve: int) -> str:
    return style.CURVES[curve % len(style.CURVES)]


def room_for(low: float, high: float) -> int:
    """Pixels for the numbers of an axis from `low` to `high`, of which there are at most eight."""
    step = (high - low) / 8.0
    digits = max(0, -int(np.floor(np.log10(step)))) if step > 0.0 else 3
    longest = max(len(f"{end:,.{digits}f}") for end in (low, high))
    return max(LEAST_AXIS_WIDTH, round(CHARACTER_WIDTH * longest) + AXIS_MARGIN)


def _axis(size: int, label: str | None = None) -> Any:
    """How an axis is drawn; `size` is of what stands beside it, pixels."""
    font = "11px sans-serif"
    axis: dict[str, Any] = {"stroke": style.MUTED, "font": font, "labelFont": font, "size": size}
    axis |= {"grid": {"stroke": style.LINE, "width": 1}, "ticks": {"show": False}}
    return axis if label is None else {**axis, "label": label, "labelSize": 18}
