"""Archives of arrays, as NumPy writes them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flowborne.base.given import check_file

SHORT = 200
"""Maximum length of a quoted message of another library."""

MOST_UNPACKED = 1 << 30
"""Maximum size in memory of arrays with a smaller file, in bytes; those of runs are not
compressed."""


def read_arrays(path: Path, names: Sequence[str] | None = None) -> dict[str, NDArray[Any]]:
    """Arrays of an .npz file by name.

    names   those to read; all when None
    raises  OSError if the file cannot be opened; ValueError if it is cut, empty or no archive,
            unpacks to more than MOST_UNPACKED, or lacks one of the names
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
                if not isinstance(values, np.ndarray):  # NumPy returns other members as bytes
                    raise ValueError(f"its '{name}' is no array")
            return found
        except Exception as error:  # NumPy, zip and zlib raise many types
            raise ValueError(f"{path} is cut or no archive of arrays ({said_of(error)})") from error


def said_of(error: Exception) -> str:
    """The text of an error, in one short line without its full stop."""
    text = " ".join(str(error).split()) or type(error).__name__
    return text.rstrip(".") if len(text) <= SHORT else f"{text[:SHORT]} ..."
