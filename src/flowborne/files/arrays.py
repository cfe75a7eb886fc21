"""Archives of arrays, as NumPy writes them: read whole, or refused in one sentence."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flowborne.files.given import check_file

SHORT = 200
"""Most letters of what another library says."""

MOST_UNPACKED = 1 << 30
"""Bytes that arrays may take where their file is smaller: those of runs are not compressed."""


def read_arrays(path: Path, names: Sequence[str] | None = None) -> dict[str, NDArray[Any]]:
    """Arrays of an .npz file by name.

    names   which; all when None
    raises  OSError when the file cannot be opened; ValueError when it is cut, empty or something
            else, unpacks to more than MOST_UNPACKED, or lacks one of the names
    """
    check_file(path, None)
    with open(path, "rb") as file:
        try:
            archive = np.lib.npyio.NpzFile(file)
            assert archive.zip is not None
            asked = sum(member.file_size for member in archive.zip.infolist())
            most = max(MOST_UNPACKED, path.stat().st_size)
            if asked > most:
                raise ValueError(
                    f"it unpacks to {asked / 2**30:.3g} GB, and {most / 2**30:.3g} GB are the most"
                )
            found = {name: archive[name] for name in names or archive.files}
            for name, values in found.items():
                if not isinstance(values, np.ndarray):  # NumPy gives the bytes of any other member
                    raise ValueError(f"its '{name}' is no array")
            return found
        except Exception as error:  # NumPy, zip and zlib raise whatever they stumble over
            raise ValueError(f"{path} is cut or no archive of arrays ({said_of(error)})") from error


def said_of(error: Exception) -> str:
    """What an error says, in one short line without its full stop."""
    text = " ".join(str(error).split()) or type(error).__name__
    return text.rstrip(".") if len(text) <= SHORT else f"{text[:SHORT]} ..."
