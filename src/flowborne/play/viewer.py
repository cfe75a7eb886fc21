"""The viewer of a simulation that is played: it asks for frames and shows them."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, wait
from pathlib import Path
from queue import Empty, SimpleQueue
from threading import Event, Thread
from time import monotonic
from typing import Any

import numpy as np

from flowborne.base.errors import SceneError
from flowborne.base.progress import RunProgress
from flowborne.kernels.arrays import Array
from flowborne.play.memory import PlayedRun
from flowborne.play.panel import SAVE, PlayPanel
from flowborne.play.playing import Moment, Play
from flowborne.runs.run_folder import RunFolder, RunFolderError
from flowborne.scenes.schema import Scene
from flowborne.sim.simulation import BlowUpError
from flowborne.view.browser.gate import Gate
from flowborne.view.browser.settings import Settings
from flowborne.view.browser.solids import Bodies
from flowborne.view.browser.surroundings import show_wind
from flowborne.view.browser.viewer import RunView, start_server
from flowborne.view.run import State

RATED = 2.0
"""s over which frames a second are counted."""

FOLLOWED = 1.0
"""s of the path of the bodies from which the place of a camera that follows them is taken."""

GHOST_OPACITY = 0.35

PATIENCE = 0.5
"""s that a frame in progress has when the viewer closes; what is played is not kept anyway."""

ASIDE = 0.45
"""Distance of the ghost beside the bodies, in smaller sides of the view."""


class PlayViewer(RunView):
    """A simulation that is played, in a browser. One thread of its own advances it.

    running  whether it goes on by itself
    """

    run: PlayedRun
    panel: PlayPanel
    image_side = 384
    margin = 1.3

    def __init__(self, gate: Gate, play: Play, run: PlayedRun, out: Path) -> None:
        """`out`: folder to record to; a number is appended if it exists."""
        self.running = True
        self._play, self._out = play, out
        self._jobs: SimpleQueue[Callable[[], None] | None] = SimpleQueue()
        # a daemon, so that a frame of minutes does not keep the process
        Thread(target=lambda: [job() for job in iter(self._jobs.get, None)], daemon=True).start()
        self._closed, self._saved = Event(), ""
        self._job: Future[Any] | None = None
        self._take: Callable[[Any], None] = self._add
        self._record_asked, self._steps, self._due = False, 0, 0.0
        self._done: deque[float] = deque()
        self._message = ""
        super().__init__(gate, run, str(out))

    def tick(self, seconds: float) -> None:
        self._collect()
        self._read_requests()
        number, playing = self.timeline.number, self.timeline.newest
        self.panel.apply_controls()
        if playing and not self.timeline.newest:
            self.running = False
        if self.timeline.number != number:
            self.panel.set_dials(self.run.moments[self.timeline.number].settings)
        self._submit()
        super().tick(seconds)
        self.panel.say(self._status())
        self.panel.show_running(self.running)

    def look(self) -> None:
        self.run.update_history()
        self.panel.curves.extend(self.run)
        self.panel.show_curves()
        super().look()

    def wait(self, seconds: float) -> None:
        if self._job is None:
            super().wait(seconds)
        else:
            wait([self._job], timeout=seconds)

    def close(self) -> None:
        """Stop server and simulation at once; a recording is stopped after its present frame.

        raises  KeyboardInterrupt if there was one: says where it is, and how to continue
        """
        self._closed.set()
        self._jobs.put(None)
        super().close()
        if self._job is not None:
            wait([self._job], timeout=None if self._take == self._say else PATIENCE)
        self._play.close()
        if self._saved:
            said, self._saved = self._saved, ""
            raise KeyboardInterrupt(said)

    def _new_panel(self) -> PlayPanel:
        self._path = [np.zeros(3)]
        self._start = self._middle(self.run.moments[0])
        self._middles = [self._start]
        self._wind: Array | None = None
        self._ghost = None
        if self.run.moments[0].ghost is not None:
            side = self._view.side
            self._ghost_frame = self.server.scene.add_frame("/run/ghost", show_axes=False)
            self._ghost = Bodies(self.server.scene, self.run, side, "ghost", GHOST_OPACITY)
        self.timeline.show_newest()
        controls, home = self._play.controls, self._show_home
        return PlayPanel(self.server.gui, self.run, self._view, self.timeline, controls, home)

    def _read_requests(self) -> None:
        timeline = self.timeline
        while True:
            try:
                request = self.panel.asked.get_nowait()
            except Empty:
                return
            if request == "run or pause":
                request = "pause" if self.running else "run"
            if request == SAVE:
                self._record_asked = True
                continue
            before = timeline.number
            self.running, self._message = request == "run", ""
            self._steps = self._steps + 1 if request == "▶" and before == len(self.run) - 1 else 0
            if self._steps:
                continue
            if request in ("◀", "▶"):
                timeline.step(-1 if request == "◀" else 1)
            elif request == "newest":
                timeline.show_newest()
            if timeline.number != before:
                self.panel.set_dials(self.run.moments[timeline.number].settings)

    def _submit(self) -> None:
        """Start what is due in the thread of the simulation, unless it is busy."""
        now = monotonic()
        if self._job is not None:
            return
        if self._record_asked:
            self._record_asked = False
            self._begin(self._say, self._record, self.run.moments[-1])
        elif (self.running and now >= self._due) or self._steps > 0:
            self._steps = max(0, self._steps - 1)
            frame_time = 1.0 / self.run.frames_per_second
            self._due = max(self._due + frame_time, now)
            if self.timeline.number < len(self.run) - 1:
                self._cut(self.timeline.number + 1)
            self.timeline.show_newest()
            self._begin(self._add, self._play.advance, self.run.moments[-1], self.panel.dials)

    def _begin(self, take: Callable[[Any], None], work: Callable[..., Any], *given: Any) -> None:
        """Let the thread of the simulation do some work, and take its result."""
        job: Future[Any] = Future()
        self._take, self._job = take, job

        def do() -> None:
            try:
                job.set_result(work(*given))
            except BaseException as error:
                job.set_exception(error)

        self._jobs.put(do)

    def _collect(self) -> None:
        if self._job is None or not self._job.done():
            return
        job, self._job = self._job, None
        try:
            self._take(job.result())
        except (BlowUpError, SceneError, RunFolderError) as error:
            self.running, self._message = False, str(error)

    def _add(self, moment: Moment) -> None:
        """Add the next frame; the time that it takes does not depend on their number."""
        run, newest = self.run, self.timeline.newest
        before = len(run)
        run.append(moment)
        dropped = before + 1 - len(run)
        self._middles.append(self._middle(moment))
        self._path.append(self._followed())
        del self._path[:dropped], self._middles[:dropped]
        self._done.append(monotonic())
        self.timeline.extend(run.times)
        self.timeline.newest = newest
        self._shown = None
        self.panel.extend_time()
        if len(run) >= 2 * self._measured:
            self._measure()

    def _cut(self, count: int) -> None:
        self.run.cut(count)
        del self._path[count:], self._middles[count:]
        self.timeline.extend(self.run.times)
        self._shown = None

    def _record(self, until: Moment) -> str:
        out = free_folder(self._out)
        scene = RunFolder(out).scene

        def show(news: RunProgress) -> None:
            self._message = f"saving frame {news.frame} of {news.frames}"
            if self._closed.is_set():
                self._saved = (
                    f"recording stopped at frame {news.frame} of {news.frames}; "
                    f"continue with: flowborne run {scene} --out {out} --resume"
                )
                raise KeyboardInterrupt

        self._message = "saving"
        return self._play.record(until, out, show)

    def _say(self, text: str) -> None:
        self._message = text

    def _status(self) -> str:
        now, wanted = monotonic(), self.run.frames_per_second
        while self._done and self._done[0] < now - RATED:
            self._done.popleft()
        said = "paused"
        if self.running and len(self._done) > 1:
            rate = (len(self._done) - 1) / (self._done[-1] - self._done[0])
            said = f"{rate:.1f} frames a second; {wanted:g} in real time"
        elif self.running:
            said = "running"
        later = len(self.run) - 1 - self.timeline.number
        if later and not self.running:
            frames = "frame" if later == 1 else f"{later} frames"
            said += f"; run drops the {frames} after this one"
        return f"{said}\n{self._message}".rstrip()

    def _middle(self, moment: Moment) -> Array:
        """(3,) mean position of the bodies' geometries, m."""
        moving = [n for n, geom in enumerate(self.run.geoms) if geom.body > 0]
        positions = moment.state["geom_position"][moving].astype(float)
        known = positions[np.isfinite(positions).all(axis=1)]
        return known.mean(axis=0) if len(known) else np.zeros(3)

    def _followed(self) -> Array:
        """(3,) displacement of the bodies since the first frame, without their swaying, m."""
        count = max(2, round(FOLLOWED * self.run.frames_per_second))
        middles = np.array(self._middles[-count:])
        n = np.arange(len(middles)) - len(middles) + 1.0
        line = np.polynomial.polynomial.polyfit(n, middles, 1)
        return np.asarray(line[0] - self._start)

    def _domain_moved(self, number: int, state: State) -> Array:
        if self.run.grid is None:
            return np.zeros(3)
        return np.array(self.run.grid_at(state).origin) - self.run.grid.origin

    def _show_more(self, number: int, settings: Settings) -> None:
        moment = self.run.moments[number]
        self._show_ghost(moment, settings.ghost)
        self._show_wind(moment)

    def _show_ghost(self, moment: Moment, chosen: str) -> None:
        """Show the input motion where it was chosen to be."""
        if self._ghost is None or moment.ghost is None:
            return
        aside = np.zeros(3)
        if chosen == "beside":
            toward = self._view.first.position - self._view.first.target
            across = np.cross([0.0, 0.0, 1.0], toward)
            if not across.any() or self.run.is_slab:
                across = np.array([1.0, 0.0, 0.0])
            aside = ASIDE * self._view.side * across / np.linalg.norm(across)
        self._ghost_frame.position, self._ghost_frame.visible = aside, chosen != "none"
        if chosen != "none":
            self._ghost.show(moment.ghost, bones=True)

    def _show_wind(self, moment: Moment) -> None:
        winds = [flow for flow in self._play.controls.flows if flow.unit == "m/s"]
        if self.run.grid is not None or not winds:
            return
        wind = np.sum([moment.values[flow.key] for flow in winds], axis=0)
        if self._wind is None or not np.array_equal(wind, self._wind):
            self._wind = wind
            show_wind(self.server.scene, wind, self._view)


def open_play(
    scene: Scene, out: Path, *, host: str, port: int, workers: int | None = None
) -> PlayViewer:
    """Start to serve a scene that is played.

    out     folder to record to; a number is appended if it exists
    raises  SceneError if the scene is wrong, viser is missing, or host and port cannot be used
    """
    gate = start_server(host, port)
    play = None
    try:
        play = Play(scene, workers)
        return PlayViewer(gate, play, PlayedRun(play), out)
    except BaseException:
        gate.stop()
        if play is not None:
            play.close()
        raise


def free_folder(out: Path) -> Path:
    """The folder, or with the first number behind it that makes it a new one."""
    number, found = 1, out
    while found.exists():
        number += 1
        found = out.with_name(f"{out.name}-{number}")
    return found
