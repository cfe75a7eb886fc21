"""From a run folder to a file that another program opens."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from flowborne.errors import PartError, SceneError
from flowborne.io.exporters import BVH, EXPORTERS, endings
from flowborne.io.open_run import OpenRun
from flowborne.io.run_folder import RunFolder


def export(run: str | Path, out: str | Path, parameters: Mapping[str, Any] | None = None) -> None:
    """Write a run as a file; the ending of its name says as what.

    run         folder of the run
    out         file to write
    parameters  of the exporter
    raises      SceneError when nothing writes such files, or the run lacks what they hold;
                RunFolderError when `run` is no run; PartError when an exporter of one's own fails;
                OSError when the file cannot be written
    """
    from flowborne.scenes.load import load_scene

    folder, path = RunFolder.existing(Path(run)), Path(out)
    load_scene(folder.scene)  # brings the plugins
    ending = path.suffix
    if ending == BVH:
        from flowborne.scenes.motion_out import export_bvh

        export_bvh(folder.path, path)
        return
    if ending not in EXPORTERS:
        raise SceneError(
            f"{path.name}: nothing writes '{ending}' files. End its name with one of "
            f"{', '.join(endings())}."
        )
    try:
        exporter = EXPORTERS.make(ending, parameters or {})
    except ValueError as error:
        raise SceneError(f"{path.name}: exporter {error}.") from error
    opened = OpenRun(folder.path)
    try:
        exporter.write(opened, path)
    except OSError:
        raise
    except Exception as error:
        raise PartError.failed(f"exporter of '{ending}' files", error) from error
