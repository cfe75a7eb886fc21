"""Opens a run in a browser and keeps the view up to date, also while the run continues."""

from __future__ import annotations

import socket
from contextlib import redirect_stdout, suppress
from dataclasses import replace
from io import StringIO
from pathlib import Path
from time import monotonic, sleep
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from flowborne.base.errors import SceneError
from flowborne.base.extras import optional
from flowborne.kernels.arrays import Array
from flowborne.runs.run_folder import RunFolder, RunFolderError, reading
from flowborne.runs.states import read_state
from flowborne.view import style
from flowborne.view.browser.fluid import MIN_IMAGE_SIDE, Fluid
from flowborne.view.browser.gate import Gate, guarded
from flowborne.view.browser.page import style_page
from flowborne.view.browser.panel import Panel, legend_html
from flowborne.view.browser.settings import Settings, Timeline
from flowborne.view.browser.solids import Bodies, ForceArrows, SkinMesh
from flowborne.view.browser.surroundings import Surroundings
from flowborne.view.browser.viewpoint import ASPECT, PHONE, CameraKeys, FilmView
from flowborne.view.framing import window_path
from flowborne.view.run import Run, State

if TYPE_CHECKING:
    from viser import ClientHandle


class GrowingRun(Run):
    """A run that may continue; `grown` reads it again with its new frames.

    started  ns, time at which its folder was written first
    """

    def __init__(self, folder: str | Path) -> None:
        files = RunFolder.existing(Path(folder))
        with reading(files.path):
            self.started = files.model.stat().st_mtime_ns
        super().__init__(folder)
        self._kept: dict[str, list[NDArray[Any]]] = {}

    def grown(self) -> GrowingRun | None:
        """The run with its new frames; None if there are none.

        A run that was started again is another one, with another `started`.
        raises  RunFolderError if it cannot be read, for example while it is being replaced
        """
        if len(RunFolder(self.folder).state_files()) == len(self):
            return None
        new = GrowingRun(self.folder)
        if new.continues(self):
            new._kept = self._kept
        return new

    def continues(self, other: GrowingRun) -> bool:
        """Whether it is the same run as `other` with as many or more frames."""
        return self.started == other.started and len(self) >= len(other)

    def every(self, name: str) -> Array:
        """The same as of any run, but each state is read once."""
        values = self._kept.setdefault(name, [])
        for path in self._states[len(values) :]:
            values.append(read_state(path, (name,))[name])
        return np.asarray(values, float)


TICK = 1.0 / 60.0
"""Interval at which controls are read, s."""

LOOK = 0.5
"""Interval at which folder and cameras are read, s."""


class RunView:
    """A run in the scene and panel of a server; `tick` keeps them up to date.

    run       with the frames so far
    timeline  the current time
    panel     the controls
    margin    distance of the first camera, in that of the film's
    """

    image_side = MIN_IMAGE_SIDE
    margin = 1.05

    def __init__(self, gate: Gate, run: Run, folder: str) -> None:
        """`folder`: of the run, for commands.

        raises  ValueError if the shot of the run's scene does not fit it
        """
        self._gate, self.server, self.folder = gate, gate.server, folder
        self._shown: tuple[Any, ...] | None = None
        self._open(run)
        self.server.on_client_connect(self._show_home)

    def tick(self, seconds: float) -> None:
        """Advance by seconds of real time, and update the scene if anything changed."""
        self.timeline.advance(seconds)
        self.panel.apply_controls()
        timeline, settings = self.timeline, self.panel.settings
        current = (timeline.number, timeline.playing, timeline.newest, settings)
        if current != self._shown:
            self._show(settings)
            self._shown = current

    def look(self) -> None:
        """Update what changes slowly: texts of the cameras of all clients."""
        self._keys.show(self.server.get_clients(), self._along)

    def wait(self, seconds: float) -> None:
        """Wait until the next tick is due."""
        sleep(seconds)

    def close(self) -> None:
        """Stop the server; its pages say so."""
        self._gate.stop()

    def _open(self, run: Run) -> None:
        """Show another run from its beginning."""
        server = self.server
        server.scene.reset()
        server.gui.reset()
        style_page(server, run.name)
        self.run, self._view = run, self._first_view(run, ASPECT)
        self._narrow_view = self._first_view(run, PHONE)
        self._path = list(self._view.path)
        self.timeline = Timeline(run.times)
        first, side = self._view.first, self._view.side
        server.initial_camera.position = tuple(first.position)
        server.initial_camera.look_at = tuple(first.target)
        server.initial_camera.fov = float(np.radians(first.lens))
        self._surroundings = Surroundings(server.scene, run, self._view)
        self._window = window_path(run)
        self._bodies = Bodies(server.scene, run, side)
        self._skins = [
            SkinMesh(server.scene, run, skin, str(n), side) for n, skin in enumerate(run.skins)
        ]
        self._measure()
        self.panel = self._new_panel()
        self._keys = CameraKeys(self.folder, run.is_slab)
        self._along = np.zeros(3)
        self._shown = None

    def _first_view(self, run: Run, aspect: float) -> FilmView:
        view = FilmView.of(run, aspect)
        first = view.first
        away = self.margin * (first.position - first.target)
        return replace(view, first=replace(first, position=first.target + away))

    def _show_home(self, client: ClientHandle | None) -> None:
        """Bring the camera of a page, if it is still there, to the first view that suits it."""
        if client is not None:
            narrow = client.camera.image_height > client.camera.image_width
            (self._narrow_view if narrow else self._view).show_to(client)

    def _new_panel(self) -> Panel:
        return Panel(self.server.gui, self.run, self._view, self.timeline, self._show_home)

    def _measure(self) -> None:
        """Take scales from the frames so far; repeated whenever their number doubles."""
        run, view = self.run, self._view
        self._measured = len(run)
        self._force_arrows = ForceArrows(self.server.scene, run, view.side)
        toward = view.first.position - view.first.target
        self._fluid = None
        if run.grid is not None:
            toward = toward / np.linalg.norm(toward)
            self._fluid = Fluid(self.server.scene, run, toward, self.image_side)

    def _show(self, settings: Settings) -> None:
        number = self.timeline.number
        state = self.run.state(number)
        self._along = self._path[number] if settings.follow else np.zeros(3)
        names, scales = ((), ()) if self._fluid is None else self._fluid.legend(settings)
        if self.run.accented:
            names = [("body on a controlled joint", style.ACCENT), *names]
        with self.server.atomic():
            # moved like the bodies, and not added anew: a browser would do that some frames later
            self._surroundings.root.position = -self._along
            self._surroundings.show(self._domain_moved(number, state))
            self._bodies.show(state, settings.bones)
            for skin in self._skins:
                skin.show(state, settings.bones, self._along)
            self._force_arrows.show(state, settings.forces, self._along)
            if self._fluid is not None:
                self._fluid.show(state, settings)
            self._show_more(number, settings)
            self.panel.show(self.run, number)
            shown = self._force_arrows.scale if settings.forces else None
            self.panel.legend.content = legend_html(names, scales, shown)
        self.server.flush()

    def _domain_moved(self, number: int, state: State) -> Array:
        """(3,) m, displacement of the fluid's domain in a state from its start."""
        return self._window[number]

    def _show_more(self, number: int, settings: Settings) -> None:
        """Show what is not in every view; the curves up to the time in this one."""
        self.panel.show_curves()


class Viewer(RunView):
    """A run in a folder, which may continue."""

    run: GrowingRun

    def look(self) -> None:
        """Read new frames of the run, and the cameras of all clients."""
        # a run that is being replaced cannot be read; the old one stays until then
        with suppress(RunFolderError):
            new = self.run.grown()
            if new is not None and new.continues(self.run):
                self._extend(new)
            elif new is not None:
                self._open(new)
        super().look()

    def _open(self, run: Run) -> None:
        super()._open(run)
        if RunFolder(run.folder).is_unfinished():
            self.timeline.show_newest()

    def _extend(self, run: GrowingRun) -> None:
        self.run, self._view, self._window = run, FilmView.of(run), window_path(run)
        self._path = list(self._view.path)
        self.timeline.extend(run.times)
        if len(run) >= 2 * self._measured:
            self._measure()
        self.panel.extend(run)
        self._shown = None


def open_viewer(folder: Path, host: str, port: int) -> Viewer:
    """Start to serve a viewer of the run in `folder`.

    raises  RunFolderError if the folder has nothing to view; SceneError if viser is missing, or
            host and port cannot be used; ValueError if the shot of the run's scene does not fit it
    """
    run = GrowingRun(folder)
    return Viewer(start_server(host, port), run, str(folder))


def start_server(host: str, port: int) -> Gate:
    """A server of a page, behind its gate. Raises SceneError as `open_viewer` does."""
    viser = optional("viser", "viser", "view", "views in a browser")
    _check_free(host, port)
    # viser prints a frame with its addresses, which our own line has
    with guarded(host) as gate, redirect_stdout(StringIO()):
        gate.server = viser.ViserServer(host=host, port=port, verbose=False)
    return gate


def serve(viewer: RunView) -> None:
    """Keep a viewer up to date until it is interrupted. Raises KeyboardInterrupt then."""
    before = looked = monotonic()
    while True:
        now = monotonic()
        viewer.tick(now - before)
        before = now
        if now - looked >= LOOK:
            viewer.look()
            looked = now
        viewer.wait(max(0.0, TICK - (monotonic() - now)))


def _check_free(host: str, port: int) -> None:
    """Raise SceneError unless a server can listen there; viser would silently use another port."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except OSError as error:
            raise SceneError(
                f"{host}, port {port} cannot be used ({error.strerror}); name another one with "
                "--port"
            ) from None
