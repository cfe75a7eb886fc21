"""The files of states/, read whole or refused in one sentence."""

from __future__ import annotations

import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from flowborne.files.arrays import read_arrays, said_of
from flowborne.files.given import check_file
from flowborne.runs.run_folder import RunFolder, RunFolderError

IN_EVERY_STATE = "geom_position", "geom_rotation", "fluid_centre", "fluid_force"
"""Arrays of a state that are drawn, whatever the scene has."""

NUMBERS = "biuf"
"""Kinds of NumPy's types that a state has."""


def read_state(path: Path, names: Sequence[str] | None = None) -> dict[str, NDArray[Any]]:
    """Arrays of a file of states/, all unless names are given; raises RunFolderError when it is
    missing or cut, has arrays that hold no numbers, or has not what is drawn of every state."""
    try:
        arrays = read_arrays(path, names)
    except (OSError, ValueError) as error:
        raise _without(path, error) from error
    for name, values in arrays.items():
        if values.dtype.kind not in NUMBERS:
            raise _without(path, ValueError(f"its '{name}' holds no numbers"))
    lacking = [] if names else [name for name in IN_EVERY_STATE if name not in arrays]
    if lacking:
        raise _without(path, ValueError(f"it lacks {', '.join(lacking)}"))
    return arrays


def check_states(folder: RunFolder, frame: int) -> None:
    """Raise RunFolderError where a state up to a frame is cut; one that is missing is no fault."""
    for path in folder.state_files():
        if int(path.stem) <= frame:
            try:
                check_file(path, None)
                zipfile.ZipFile(path).close()
            except (OSError, zipfile.BadZipFile) as error:
                raise _without(path, error) from error


def _without(path: Path, error: Exception) -> RunFolderError:
    return RunFolderError(
        f"state {path} cannot be read ({said_of(error)}); remove it, and films and exports go on "
        "without its frame"
    )
