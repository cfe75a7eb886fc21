"""The panel next to the scene: time, what is shown, legend and curves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from flowborne.kernels.arrays import Array
from flowborne.view import style
from flowborne.view.browser.settings import Settings, Timeline
from flowborne.view.browser.viewpoint import FilmView
from flowborne.view.fields import Scale
from flowborne.view.glyphs import Forces, round_number
from flowborne.view.plots import robust_limits, signed, strip_curves
from flowborne.view.run import Run

if TYPE_CHECKING:
    from viser import ClientHandle, GuiApi

ARROW_LENGTH = 60.0
"""Length of the arrow of a large force in the legend, pixels."""

MAX_SAMPLES = 400
"""Maximum number of points of a curve that are sent: about one per pixel."""

CHARACTER_WIDTH, AXIS_MARGIN = 6.6, 16
"""Width of a character of an axis number, and the space between numbers and plot, pixels."""

MIN_AXIS_WIDTH = 58
"""Minimum width of the numbers at an axis, so that plots in a column are aligned, pixels."""

PACES = {"1/8": 0.125, "1/4": 0.25, "1/2": 0.5, "1": 1.0, "2": 2.0}
"""Name of a pace -> seconds of the run per second."""

AXES = "xyz"

Home = Callable[["ClientHandle | None"], None]
"""Brings the camera of a page to the first view."""

CLOCK = (
    '<div style="padding:8px 12px 2px;display:flex;justify-content:space-between;'
    'font-variant-numeric:tabular-nums"><b style="font-size:17px">t = {time:.3f} s</b>'
    '<span style="align-self:end">frame {frame} of {last}{state}</span></div>'
)
"""HTML of the time of a state."""


def legend_html(
    names: Sequence[tuple[str, str]], scales: Sequence[Scale], forces: Forces | None
) -> str:
    """The legend as HTML.

    names   (name, colour) of what has its own colour
    scales  of colours
    forces  that are shown as arrows, if any
    """
    rows = [_named(name, colour) for name, colour in names]
    rows += [_bar(scale) for scale in scales]
    if forces is not None and forces.large > 0.0:
        rows.append(_force(forces))
    body = "".join(f'<div style="margin:0 0 8px">{row}</div>' for row in rows)
    return f'<div style="padding:6px 12px 0;font-size:13px;line-height:1.4">{body}</div>'


def _named(name: str, colour: str) -> str:
    dot = f"display:inline-block;width:11px;height:11px;border-radius:6px;background:{colour}"
    return f'<span style="{dot};margin-right:8px"></span>{escape(name)}'


def _bar(scale: Scale) -> str:
    colours, low, high, name = scale
    picked = colours[np.linspace(0, len(colours) - 1, 24).round().astype(int)]
    stops = ",".join(f"rgb({r},{g},{b})" for r, g, b in np.rint(255.0 * picked).astype(int))
    bar = f"height:11px;border-radius:3px;background:linear-gradient(to right,{stops})"
    ends = f"<span>{signed(low)}</span><span>{signed(high)}</span>"
    between = "display:flex;justify-content:space-between;font-variant-numeric:tabular-nums"
    return f'{escape(name)}<div style="{bar}"></div><div style="{between}">{ends}</div>'


def _force(forces: Forces) -> str:
    force = round_number(forces.large)
    length = ARROW_LENGTH * force / forces.large
    line = (
        f"display:inline-block;vertical-align:middle;height:3px;width:{length:.0f}px;"
        f"background:{style.FORCE}"
    )
    head = (
        "display:inline-block;vertical-align:middle;border:5px solid transparent;"
        f"border-left:9px solid {style.FORCE};border-right:0;margin-right:8px"
    )
    what = f"force on a body: {force:,.12g} {forces.unit}"
    return f'<span style="{line}"></span><span style="{head}"></span>{what}'


class Curves:
    """The plots of a run, as in its film: the whole run faint, the past bright."""

    def __init__(self, gui: GuiApi, run: Run, seconds: float = np.inf) -> None:
        """`seconds`: of the end of the run that are shown."""
        self._gui, self._seconds = gui, seconds
        self._shown: list[Any] = []
        self._titles: list[tuple[str, tuple[str, ...]]] = []
        self.plots: list[Any] = []
        self.extend(run)

    def extend(self, run: Run) -> None:
        """Update the curves to a run with new frames."""
        times = run.history["time_s"]
        first = int(np.searchsorted(times, times[-1] - self._seconds)) if len(times) else 0
        chosen = np.unique(np.linspace(first, len(times) - 1, MAX_SAMPLES).round().astype(int))
        strips = strip_curves(run) if len(times) else []
        titles = [(title, tuple(curves)) for title, curves in strips]
        self._times = times[chosen] if len(times) else times
        self._values = [
            np.stack([curve[chosen] for curve in curves.values()]) for _, curves in strips
        ]
        if titles != self._titles:
            self._replace(titles)
        for plot, values in zip(self.plots, self._values, strict=True):
            low, high = steady_limits(*robust_limits(values))
            x = steady_limits(float(times[first]), float(times[-1]))
            scales = {"x": {"time": False, "range": x}, "y": {"range": (low, high)}}
            if scales != plot.scales:
                plot.scales = scales
                plot.axes = (_axis(34, "time (s)"), _axis(room_for(low, high)))
            plot.data = self._data(values, 0.0)

    def _replace(self, titles: list[tuple[str, tuple[str, ...]]]) -> None:
        for shown in self._shown:
            shown.remove()
        self._shown, self.plots, self._titles = [], [], titles
        for (title, names), values in zip(titles, self._values, strict=True):
            heading = self._gui.add_html(_title(title, names))
            plot = self._gui.add_uplot(
                self._data(values, 0.0),
                _series(len(names)),
                padding=(8, 16, 0, 0),
                legend={"show": False},
                height=150,
            )
            self._shown += [heading, plot]
            self.plots.append(plot)

    def show(self, time: float) -> None:
        """Highlight the curves up to a time, s."""
        for plot, values in zip(self.plots, self._values, strict=True):
            plot.data = self._data(values, time)

    def _data(self, values: Array, time: float) -> tuple[Array, ...]:
        """Times, every curve of values (k, n), and every curve up to a time."""
        past = np.where(self._times <= time + 1e-9, values, np.nan)
        return (self._times, *values, *past)


def _title(title: str, names: Sequence[str]) -> str:
    named = [
        f'<span style="color:{_colour(n)};margin-left:10px">{escape(name)}</span>'
        for n, name in enumerate(names)
    ]
    return (
        '<div style="padding:6px 12px 0;font-size:13px;line-height:1.3">'
        f"{escape(title)}{''.join(named)}</div>"
    )


def _series(count: int) -> tuple[Any, ...]:
    """uPlot's series: times, and a number of curves, whole and past."""
    points = {"show": False}
    whole = [{"stroke": f"{_colour(n)}50", "width": 1.2, "points": points} for n in range(count)]
    past = [{"stroke": _colour(n), "width": 2.2, "points": points} for n in range(count)]
    return ({"label": "time (s)"}, *whole, *past)


def _colour(curve: int) -> str:
    return style.CURVES[curve % len(style.CURVES)]


def steady_limits(low: float, high: float) -> tuple[float, float]:
    """Limits of an axis around others, which change seldom while these grow: a plot with other
    limits is drawn anew."""
    if not high > low:
        return low, high
    step = round_number(0.5 * (high - low))
    return step * float(np.floor(low / step)), step * float(np.ceil(high / step))


def room_for(low: float, high: float) -> int:
    """Width of the numbers of an axis from `low` to `high`, at most eight of them, pixels."""
    step = (high - low) / 8.0
    digits = max(0, -int(np.floor(np.log10(step)))) if step > 0.0 else 3
    longest = max(len(f"{end:,.{digits}f}") for end in (low, high))
    return max(MIN_AXIS_WIDTH, round(CHARACTER_WIDTH * longest) + AXIS_MARGIN)


def _axis(size: int, label: str | None = None) -> Any:
    font = "11px sans-serif"
    axis: dict[str, Any] = {"stroke": style.MUTED, "font": font, "labelFont": font, "size": size}
    axis |= {"grid": {"stroke": style.LINE, "width": 1}, "ticks": {"show": False}}
    return axis if label is None else {**axis, "label": label, "labelSize": 18}


class Panel:
    """The controls of a run, which change a timeline; `settings` has their values.

    legend   HTML that explains colours and arrows
    seconds  of the end of the run that the plots show
    """

    seconds = np.inf

    def __init__(
        self, gui: GuiApi, run: Run, view: FilmView, timeline: Timeline, home: Home
    ) -> None:
        """`home`: brings the camera of a page to the first view."""
        self._timeline = timeline
        self._controls: dict[str, Any] = {}
        self._slider_time = 0.0
        self._pace: Any = None
        self._frames_per_second = run.frames_per_second
        gui.set_panel_label(run.name)
        gui.configure_theme(dark_mode=True, show_logo=False, show_share_button=False)
        gui.main_panel.dock_right()
        gui.main_panel.set_width(360)
        self._add_time(gui)
        self.legend = gui.add_html("")
        self._add_shown(gui, run, view)
        self._add_home(gui, home)
        self.curves = Curves(gui, run, self.seconds)

    @property
    def settings(self) -> Settings:
        """The current values of the controls."""
        values = {name: control.value for name, control in self._controls.items()}
        if "axis" in values:
            values["axis"] = AXES.index(values["axis"])
        return Settings(**values)

    def apply_controls(self) -> None:
        """Apply pace and slider to the timeline; hide the controls of a slice if there is none."""
        if "slice" in self._controls:
            sliced = self._controls["slice"].value != "none" or self._controls["velocity"].value
            self._controls["axis"].visible = self._controls["coordinate"].visible = sliced
        if self._pace is not None:
            self._timeline.pace = PACES[self._pace.value]
        if self._slider.value != self._slider_time:
            self._timeline.seek(self._slider.value)
            self._slider_time = self._slider.value

    def show(self, run: Run, number: int) -> None:
        """Show the time of a state of the run."""
        timeline = self._timeline
        state = ", playing" if timeline.playing else ", newest" if timeline.newest else ""
        self._clock.content = CLOCK.format(
            time=timeline.times[number], frame=run.frames[number], last=run.frames[-1], state=state
        )
        self._slider_time = self._slider.value = round(float(timeline.time), 4)

    def show_curves(self) -> None:
        """Show the curves up to the time."""
        self.curves.show(self._timeline.times[self._timeline.number])

    def extend(self, run: Run) -> None:
        """Update to a run with new frames."""
        self._slider.max = max(float(self._timeline.times[-1]), self._slider.step)
        self.curves.extend(run)

    def _add_time(self, gui: GuiApi) -> None:
        timeline = self._timeline
        self._clock = gui.add_html("")
        step = 1.0 / self._frames_per_second
        first, last = float(timeline.times[0]), float(timeline.times[-1])
        self._slider: Any = gui.add_slider("time (s)", first, max(last, first + step), 1e-4, first)
        self._slider_time = self._slider.value
        moves: dict[str, Callable[[], None]] = {
            "◀": lambda: timeline.step(-1),
            "play": timeline.play,
            "▶": lambda: timeline.step(1),
            "newest": timeline.show_newest,
        }
        buttons = gui.add_button_group("", list(moves))
        buttons.on_click(lambda event: moves[event.target.value]())
        self._add_key(gui, "play or stop", "space", timeline.play)
        self._add_key(gui, "next frame", "arrowright", moves["▶"])
        self._add_key(gui, "frame before", "arrowleft", moves["◀"])
        self._add_key(gui, "newest frame", "end", timeline.show_newest)
        self._pace = gui.add_dropdown("pace", list(PACES), initial_value="1")

    def _add_home(self, gui: GuiApi, home: Home) -> None:
        button, key = gui.add_button_group("view", ["home"]), gui.add_command("home", hotkey="home")
        button.on_click(lambda event: home(event.client))
        key.on_trigger(lambda event: home(event.client))

    def _add_key(self, gui: GuiApi, name: str, key: Any, does: Callable[[], None]) -> None:
        gui.add_command(name, hotkey=key).on_trigger(lambda _: does())

    def _add_shown(self, gui: GuiApi, run: Run, view: FilmView) -> None:
        controls, shot = self._controls, run.shot
        if run.grid is not None:
            fields = [*(["dye"] if run.dyes else []), "vorticity"]
            fields += ["speed", "pressure", "none"] if run.is_slab else ["none"]
            first: str = shot.field if shot.field in fields else "none"
            controls["field"] = gui.add_dropdown("fluid", fields, initial_value=first)
            if not run.is_slab:
                self._add_slice(gui, run, view)
            controls["velocity"] = gui.add_checkbox("velocity arrows", False)
        controls["forces"] = gui.add_checkbox("forces", True)
        if run.skins or any(geom.covered for geom in run.geoms):
            controls["bones"] = gui.add_checkbox("bones", shot.bones)
        windowed = bool(run.window_axes) and shot.camera.follow != "nothing"
        if windowed or np.ptp(view.path, axis=0).max() > 0.0:
            controls["follow"] = gui.add_checkbox("follow", True)

    def _add_slice(self, gui: GuiApi, run: Run, view: FilmView) -> None:
        """Add the controls of a slice, at first facing the camera through its target."""
        assert run.grid is not None
        controls, shot = self._controls, run.shot
        toward = view.first.position - view.first.target
        axis = int(np.argmax(np.abs(toward[:2])))
        kinds = ["none", "speed", "pressure"]
        first: str = shot.field if shot.field in kinds else "none"
        controls["slice"] = gui.add_dropdown("slice", kinds, initial_value=first)
        across = gui.add_dropdown("across", list(AXES), initial_value=AXES[axis])
        low, high, h = run.grid.origin, run.grid.upper, run.grid.spacing
        coordinate: Any = gui.add_slider(
            "at (m)",
            low[axis] + 0.5 * h,
            high[axis] - 0.5 * h,
            h,
            float(np.clip(view.first.target[axis], low[axis] + 0.5 * h, high[axis] - 0.5 * h)),
        )
        controls["axis"], controls["coordinate"] = across, coordinate

        @across.on_update
        def _(_: Any) -> None:
            n = AXES.index(across.value)
            coordinate.min, coordinate.max = low[n] + 0.5 * h, high[n] - 0.5 * h
            coordinate.value = float(np.clip(view.first.target[n], coordinate.min, coordinate.max))
