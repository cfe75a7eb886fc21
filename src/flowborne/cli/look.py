"""Commands that show a run or a scene in a browser."""

from __future__ import annotations

from contextlib import closing, suppress
from pathlib import Path
from typing import Annotated

import typer

from flowborne.base.extras import optional
from flowborne.cli.app import (
    LOOK,
    FolderArgument,
    HostOption,
    InputError,
    PortOption,
    SceneArgument,
    SceneOption,
    WorkersOption,
    command,
    compilation_shown,
    overrides_of,
)
from flowborne.runs.run_folder import RunFolder


@command(LOOK, "flowborne view runs/eel")
def view(folder: FolderArgument, port: PortOption = 8080, host: HostOption = "127.0.0.1") -> None:
    """View a run in a browser, also while it goes on."""
    RunFolder.existing(folder)
    _start()
    from flowborne.view.browser.viewer import open_viewer, serve

    try:
        viewer = open_viewer(folder, host, port)
    except ValueError as error:
        raise InputError(str(error)) from error
    print(f"viewing {folder} at http://{host}:{port}; Ctrl-C ends it", flush=True)
    with closing(viewer), suppress(KeyboardInterrupt):
        serve(viewer)


@command(LOOK, "flowborne play human-wind-back")
def play(
    scene: SceneArgument,
    settings: SceneOption = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder to record to.", show_default="runs/<scene name>-played"),
    ] = None,
    workers: WorkersOption = None,
    port: PortOption = 8080,
    host: HostOption = "127.0.0.1",
) -> None:
    """Run a scene live in a browser, and change winds, streams and objectives meanwhile."""
    from flowborne.scenes.load import load_scene

    loaded = load_scene(scene, overrides_of(settings))
    _start()
    from flowborne.play.viewer import open_play
    from flowborne.view.browser.viewer import serve

    folder = Path("runs") / f"{loaded.name}-played" if out is None else out
    with compilation_shown():
        viewer = open_play(loaded, folder, host=host, port=port, workers=workers)
    print(f"playing {loaded.name} at http://{host}:{port}; Ctrl-C ends it", flush=True)
    with closing(viewer), suppress(KeyboardInterrupt):
        serve(viewer)


def _start() -> None:
    """Say that a page starts: its libraries take seconds to import. Raises SceneError if they are
    not installed."""
    print("starting the page …", flush=True)
    optional("pyvista", "PyVista", "view", "views in a browser")
