"""The panel of a simulation that is played: time, what can be set, and what is shown."""

from __future__ import annotations

from html import escape
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any

from flowborne.play.controls import Controls, Settings
from flowborne.play.memory import PlayedRun
from flowborne.view.browser.panel import Home, Panel
from flowborne.view.browser.settings import Timeline
from flowborne.view.browser.viewpoint import FilmView
from flowborne.view.run import Run

if TYPE_CHECKING:
    from viser import GuiApi

RUN, PAUSE = "run", "pause"
"""The label of one button: what it does next."""

KEYS: tuple[tuple[str, Any, str], ...] = (
    ("frame before", "arrowleft", "◀"),
    ("next frame", "arrowright", "▶"),
    ("newest frame", "end", "newest"),
    ("run or pause", "space", "run or pause"),
)
"""Name, key and request of each key."""

SAVE = "save as a run"
SAID = '<div style="padding:2px 12px 8px;font-size:14px;white-space:pre-wrap">{}</div>'
LAST_SECONDS = 10.0
"""Seconds that the plots show."""

GHOSTS = ("none", "in place", "beside")

EXPANDED = 4
"""Number of folders of settings up to which all are open at the start; else the first one is."""


def _buttons(toggle: str) -> tuple[str, ...]:
    """Labels of the buttons, which are what they ask for."""
    return ("◀", toggle, "▶", "newest")


class PlayPanel(Panel):
    """Panel with what can be set; its settings and requests are read by the viewer.

    asked  what buttons and keys asked for
    """

    seconds = LAST_SECONDS

    def __init__(
        self,
        gui: GuiApi,
        run: PlayedRun,
        view: FilmView,
        timeline: Timeline,
        controls: Controls,
        home: Home,
    ) -> None:
        self.asked: SimpleQueue[str] = SimpleQueue()
        self._has_ghost = run.moments[0].ghost is not None
        self._controls_of_play = controls
        self._dials: dict[str, Any] = {}
        super().__init__(gui, run, view, timeline, home)

    @property
    def dials(self) -> dict[str, float | str]:
        """The settings now."""
        return {
            name: dial.value if isinstance(dial.value, str) else float(dial.value)
            for name, dial in self._dials.items()
        }

    def set_dials(self, settings: Settings) -> None:
        """Show other settings."""
        for name, value in settings.items():
            if self._dials[name].value != value:
                self._dials[name].value = value

    def say(self, text: str) -> None:
        """Show a text below the buttons."""
        content = SAID.format(escape(text))
        if content != self._said.content:
            self._said.content = content

    def show_running(self, running: bool) -> None:
        """Let the button say what it does next."""
        options = _buttons(PAUSE if running else RUN)
        if options != self._buttons.options:
            self._buttons.options = options

    def extend_time(self) -> None:
        """Let the slider reach over the frames now."""
        times = self._timeline.times
        first, last = float(times[0]), float(times[-1])
        if self._slider.min != first:
            self._slider.min = first
        # seldom, as a slider that changes its ends is drawn anew
        if not last <= self._slider.max <= 2.0 * last + 2.0:
            self._slider.max = 1.5 * last + 1.0

    def _add_time(self, gui: GuiApi) -> None:
        self._clock = gui.add_html("")
        first = float(self._timeline.times[0])
        self._slider = gui.add_slider("time (s)", first, first + 1.0, 1e-4, first)
        self._slider_time = self._slider.value
        self._buttons = gui.add_button_group("", _buttons(RUN))
        self._buttons.on_click(lambda event: self.asked.put(event.target.value))
        for name, key, request in KEYS:
            self._ask_by(gui.add_command(name, hotkey=key), request)
        self._said = gui.add_html("")
        self._add_dials(gui)
        gui.add_button(SAVE).on_click(lambda _: self.asked.put(SAVE))

    def _ask_by(self, command: Any, request: str) -> None:
        command.on_trigger(lambda _: self.asked.put(request))

    def _add_dials(self, gui: GuiApi) -> None:
        folders: dict[str, Any] = {}
        titles = {control.name.rpartition(": ")[0] for control in self._controls_of_play.all}
        few = len(titles) <= EXPANDED
        for control in self._controls_of_play.all:
            title, _, label = control.name.rpartition(": ")
            if title not in folders:
                folders[title] = gui.add_folder(title, expand_by_default=few or not folders)
            with folders[title]:
                value: Any = control.value
                if control.options:
                    dial: Any = gui.add_dropdown(label, control.options, initial_value=value)
                else:
                    dial = gui.add_slider(label, *control.limits, value)
            self._dials[control.name] = dial

    def _add_shown(self, gui: GuiApi, run: Run, view: FilmView) -> None:
        super()._add_shown(gui, run, view)
        if "follow" not in self._controls and run.shot.camera.follow != "nothing":
            walks = run.grid is None and not run.is_slab
            self._controls["follow"] = gui.add_checkbox("follow", walks)
        if self._has_ghost:
            self._controls["ghost"] = gui.add_dropdown(
                "input motion", list(GHOSTS), initial_value="none"
            )
