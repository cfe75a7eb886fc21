"""The controls beside the scene: time, what is shown, legend, curves."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from flowborne.view.browser.curves import Curves
from flowborne.view.browser.settings import Settings
from flowborne.view.browser.timeline import Timeline
from flowborne.view.browser.viewpoint import FilmView
from flowborne.view.fields import dyes_of
from flowborne.view.run import Run

if TYPE_CHECKING:
    from viser import GuiApi

WIDTH = 360
"""Of the panel, pixels."""

PACES = {"1/8": 0.125, "1/4": 0.25, "1/2": 0.5, "1": 1.0, "2": 2.0}
"""Seconds of the run in a second, by its name."""

AXES = "xyz"


class Panel:
    """The controls of a run, which change a timeline; `settings` is what they say.

    legend  HTML that says what colours and arrows stand for
    """

    def __init__(self, gui: GuiApi, run: Run, view: FilmView, timeline: Timeline) -> None:
        self._timeline = timeline
        self._controls: dict[str, Any] = {}
        self._said = 0.0
        self._frames_per_second = run.frames_per_second
        gui.set_panel_label(run.name)
        gui.configure_theme(dark_mode=True, show_logo=False, show_share_button=False)
        gui.main_panel.dock_right()
        gui.main_panel.set_width(WIDTH)
        self._add_time(gui)
        self.legend = gui.add_html("")
        self._add_shown(gui, run, view)
        self.curves = Curves(gui, run)

    @property
    def settings(self) -> Settings:
        """What the controls say now."""
        said = {name: control.value for name, control in self._controls.items()}
        if "axis" in said:
            said["axis"] = AXES.index(said["axis"])
        return Settings(**said)

    def obey(self) -> None:
        """Go at the pace that is chosen, and to the time to which somebody has moved the slider;
        offer where a slice is when there is one."""
        if "slice" in self._controls:
            sliced = self._controls["slice"].value != "none" or self._controls["velocity"].value
            self._controls["axis"].visible = self._controls["place"].visible = sliced
        self._timeline.pace = PACES[self._pace.value]
        if self._slider.value != self._said:
            self._timeline.seek(self._slider.value)
            self._said = self._slider.value

    def show(self, run: Run, number: int) -> None:
        """Tell the time of a state of the run, and where the curves are then."""
        timeline = self._timeline
        state = ", playing" if timeline.playing else ", newest" if timeline.newest else ""
        self._clock.content = CLOCK.format(
            time=timeline.times[number],
            frame=int(run.states[number].stem),
            last=int(run.states[-1].stem),
            state=state,
        )
        self._said = self._slider.value = round(float(timeline.time), 4)
        self.curves.show(timeline.times[number])

    def extend(self, run: Run) -> None:
        """Take a run that has come farther."""
        self._slider.max = max(float(self._timeline.times[-1]), self._slider.step)
        self.curves.extend(run)

    def _add_time(self, gui: GuiApi) -> None:
        timeline = self._timeline
        self._clock = gui.add_html("")
        step = 1.0 / self._frames_per_second
        first, last = float(timeline.times[0]), float(timeline.times[-1])
        self._slider: Any = gui.add_slider("time (s)", first, max(last, first + step), 1e-4, first)
        self._said = self._slider.value
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

    def _add_key(self, gui: GuiApi, name: str, key: Any, does: Callable[[], None]) -> None:
        gui.add_command(name, hotkey=key).on_trigger(lambda _: does())

    def _add_shown(self, gui: GuiApi, run: Run, view: FilmView) -> None:
        controls, shot = self._controls, run.shot
        if run.grid is not None:
            dyes = dyes_of(run)
            fields = [*(["dye"] if dyes else []), "vorticity"]
            fields += ["speed", "pressure", "none"] if run.slab else ["none"]
            first: str = shot.field if shot.field in fields else "none"
            controls["field"] = gui.add_dropdown("fluid", fields, initial_value=first)
            if not run.slab:
                self._add_slice(gui, run, view)
            controls["velocity"] = gui.add_checkbox("velocity arrows", False)
        controls["forces"] = gui.add_checkbox("forces", True)
        if run.skins or any(geom.covered for geom in run.geoms):
            controls["bones"] = gui.add_checkbox("bones", shot.bones)
        if np.ptp(view.path, axis=0).max() > 0.0:
            controls["follow"] = gui.add_checkbox("follow", True)

    def _add_slice(self, gui: GuiApi, run: Run, view: FilmView) -> None:
        """A slice, at first through what is looked at and across the view."""
        assert run.grid is not None
        controls, shot = self._controls, run.shot
        toward = view.first.position - view.first.target
        axis = int(np.argmax(np.abs(toward[:2])))
        kinds = ["none", "speed", "pressure"]
        first: str = shot.field if shot.field in kinds else "none"
        controls["slice"] = gui.add_dropdown("slice", kinds, initial_value=first)
        across = gui.add_dropdown("across", list(AXES), initial_value=AXES[axis])
        low, high, h = run.grid.origin, run.grid.upper, run.grid.spacing
        place: Any = gui.add_slider(
            "at (m)",
            low[axis] + 0.5 * h,
            high[axis] - 0.5 * h,
            h,
            float(np.clip(view.first.target[axis], low[axis] + 0.5 * h, high[axis] - 0.5 * h)),
        )
        controls["axis"], controls["place"] = across, place

        @across.on_update
        def _(_: Any) -> None:
            n = AXES.index(across.value)
            place.min, place.max = low[n] + 0.5 * h, high[n] - 0.5 * h
            place.value = float(np.clip(view.first.target[n], place.min, place.max))


CLOCK = (
    '<div style="padding:8px 12px 2px;display:flex;justify-content:space-between;'
    'font-variant-numeric:tabular-nums"><b style="font-size:17px">t = {time:.3f} s</b>'
    '<span style="align-self:end">frame {frame} of {last}{state}</span></div>'
)
"""The time of a state."""
