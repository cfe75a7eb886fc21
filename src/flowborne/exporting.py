"""From a run folder to a file that another program opens."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from flowborne.errors import PartError, SceneError
from flowborne.runs.exporters import EXPORTERS, Written, can_write, endings
from flowborne.runs.open_run import OpenRun
from flowborne.runs.run_folder import RunFolder, RunFolderError


def export(
    run: str | Path, out: str | Path, parameters: Mapping[str, Any] | None = None
) -> Written:
    """Write a run as a file; the ending of its name says as what.

    run         folder of the run; one that goes on, or was stopped, gives the frames that it has
    out         file to write; its folder is made
    parameters  of the exporter
    returns     the files that were written, and what there is to tell of them
    raises      SceneError when nothing writes such files, the run lacks what they hold, or a
                library is missing; RunFolderError when `run` is no run; PartError when an exporter
                of one's own fails; OSError when the file cannot be written
    """
    from flowborne.scenes.load import read_scene

    folder, path = RunFolder.existing(Path(run)), Path(out)
    read_scene(folder.scene)  # brings the plugins
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
    passing = OSError, RunFolderError, SceneError
    part = f"exporter of '{ending}' files"
    with PartError.guarding(part, *passing):
        written = exporter.write(opened, path)
    if not isinstance(written, Written | None):
        raise PartError(f"{part} gave {written!r:.100}: return nothing, or what was Written")
    return Written((path,)) if written is None else written
