"""Commands that take a run away: as a film, or into another program."""

from __future__ import annotations

from pathlib import Path
from time import perf_counter
from typing import Annotated

import typer

from flowborne.base.errors import PartError
from flowborne.base.extras import check_drawing
from flowborne.cli.app import TAKE_AWAY, FolderArgument, command, overrides_of, set_option, writing
from flowborne.runs.run_folder import RunFolder


@command(TAKE_AWAY, "flowborne film runs/eel --out eel.webp --set camera.orbit=30")
def film(
    folder: FolderArgument,
    settings: Annotated[
        list[str] | None, set_option("Change a value of [film]: camera.orbit=30")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="film.mp4, film.webp, or frames.png for frames_0000.png and so on.",
            show_default="preview.png and preview.mp4 in DIR",
        ),
    ] = None,
) -> None:
    """Redraw the picture and the film of a run, as set in [film] of its scene."""
    files = RunFolder.existing(folder)
    check_drawing()
    from flowborne.base.progress import ProgressDisplay, RunProgress
    from flowborne.scenes.save import film_settings
    from flowborne.view.film import make_preview, write_shot
    from flowborne.view.shot import Shot

    shot = Shot.model_validate(film_settings(files, overrides_of(settings)))
    drawn = f"{files.picture}, {files.film}"
    began = perf_counter()
    with writing(folder if out is None else out, ValueError), ProgressDisplay() as display:

        def show(done: int, frames: int) -> None:
            display(RunProgress("film", done, frames, perf_counter() - began))

        if out is None:
            make_preview(files.path, show, shot)
        else:
            drawn = write_shot(files.path, out, show, shot)
    print(f"drawn: {drawn}")


@command(TAKE_AWAY, "flowborne export runs/human-wind-back --out walk.bvh")
def export(
    folder: FolderArgument,
    out: Annotated[
        Path, typer.Option(metavar="FILE", help="File to write; its ending selects the format.")
    ],
    settings: Annotated[list[str] | None, set_option("A parameter of the exporter.")] = None,
) -> None:
    """Export a run for another program: USD, glTF, Alembic, OpenVDB, VTK, BVH, tables."""
    from flowborne.formats.exporting import export as export_run
    from flowborne.scenes.load import value_of

    parameters = {key: value_of(text) for key, text in overrides_of(settings).items()}
    with writing(out, PartError):
        written = export_run(folder, out, parameters)
    first, last = written.files[0], written.files[-1]
    print(f"written: {first}" if first == last else f"written: {first} to {last}")
    if written.note:
        print(f"  {written.note}")
