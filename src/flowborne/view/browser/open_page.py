"""A run in a browser, from Python: the page is served beside what else the program does."""

from __future__ import annotations

from contextlib import suppress
from html import escape
from pathlib import Path
from threading import Event, Thread
from typing import TYPE_CHECKING, Any

from flowborne.base.arguments import PATH, TEXT, read, such, takes
from flowborne.base.extras import optional
from flowborne.runs.open_run import StoredRun

if TYPE_CHECKING:
    from flowborne.view.open_run import OpenRun

PORT = such(range(1, 65536).__contains__, "a whole number from 1 to 65535")


class Page:
    """A page that shows a run until `close`, or the end of the program.

    folder   of the run
    address  of the page, for a browser
    """

    def __init__(self, folder: Path, address: str, viewer: Any) -> None:
        self.folder, self.address = folder, address
        self._viewer, self._closed = viewer, Event()
        viewer.wait = self._wait
        self._thread = Thread(target=self._serve, name=f"page of {folder}", daemon=True)
        self._thread.start()

    def __repr__(self) -> str:
        return f"Page of {self.folder} at {self.address}"

    def _repr_html_(self) -> str:
        link = f'<a href="{self.address}" target="_blank">{self.address}</a>'
        frame = f'<iframe src="{self.address}" width="100%" height="480"></iframe>'
        return f"<p>{escape(str(self.folder))}: {link}</p>{frame}"

    def close(self) -> None:
        """End the page; its address is free again."""
        self._closed.set()
        self._thread.join()
        self._viewer.server.stop()

    def __enter__(self) -> Page:
        return self

    def __exit__(self, *raised: object) -> None:
        self.close()

    def _serve(self) -> None:
        from flowborne.view.browser.viewer import serve

        with suppress(_ClosedError):
            serve(self._viewer)

    def _wait(self, seconds: float) -> None:
        if self._closed.wait(seconds):
            raise _ClosedError


class _ClosedError(Exception):
    """The page has been closed."""


@takes(port=PORT, host=TEXT)
def view(run: OpenRun | str | Path, port: int = 8080, host: str = "127.0.0.1") -> Page:
    """View a run in a browser, also while it goes on. The page is served until it is closed or the
    program ends; a notebook shows it.

    run     the run, or its folder
    port    of the page, which must be free
    host    "0.0.0.0" lets other machines connect
    raises  RunFolderError if there is nothing to view; SceneError if PyVista or viser is not
            installed, or host and port cannot be used; ValueError if the shot of the run's scene
            does not fit it
    """
    optional("pyvista", "PyVista", "view", "views in a browser")
    from flowborne.view.browser.viewer import open_viewer

    folder = run.folder if isinstance(run, StoredRun) else Path(read(PATH, run, "run"))
    return Page(folder, f"http://{host}:{port}", open_viewer(folder, host, port))
