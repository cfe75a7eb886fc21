"""Export of a run for other programs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from flowborne.base.arguments import PARAMETERS, PATH, or_none, takes
from flowborne.base.errors import PartError, SceneError
from flowborne.runs.exporters import EXPORTERS, Written, can_write, endings
from flowborne.runs.run_folder import RunFolder, RunFolderError
from flowborne.view.open_run import OpenRun


@takes(run=PATH, out=PATH, parameters=or_none(PARAMETERS))
def export(
    run: str | Path, out: str | Path, parameters: Mapping[str, Any] | None = None
) -> Written:
    """Write a run as a file; the ending of its name selects the format.

    run         folder of the run, which may still be running or have been stopped
    out         file to write; its folder is created
    parameters  of the exporter
    returns     the written files, and a note about them
    raises      SceneError if no exporter has this ending, the run lacks the required data, or a
                library is missing; RunFolderError if `run` is no run; PartError if a user's
                exporter fails; OSError if the file cannot be written
    """
    from flowborne.scenes.load import read_scene

    folder, path = RunFolder.existing(Path(run)), Path(out)
    read_scene(folder.scene)  # imports the plugins
    ending = path.suffix
    if not can_write(ending):
        raise SceneError(
            f"{path.name}: nothing writes '{ending}' files. End its name with one of "
            f"{', '.join(endings())}."
        )
    try:
        exporter = EXPORTERS.make(ending, parameters or {})
    except ValueError as error:
        raise SceneError(f"{path.name}: exporter {error}.") from error
    opened = OpenRun(folder.path)
    path.parent.mkdir(parents=True, exist_ok=True)
    part = f"exporter of '{ending}' files"
    with PartError.guarding(part, OSError, RunFolderError, SceneError):
        written = exporter.write(opened, path)
    if not isinstance(written, Written | None):
        raise PartError(f"{part} gave {written!r:.100}: return nothing, or what was Written")
    return Written((path,)) if written is None else written
