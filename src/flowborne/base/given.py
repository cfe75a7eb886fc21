"""Files named by a user: only regular ones, up to a maximum size, also of what they unpack to."""

from __future__ import annotations

import errno
import json
import os
import stat
import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from numpy.typing import NDArray


MOST_BYTES = 1 << 28
"""Maximum size of a file that is read whole, in bytes."""

LONGEST_NAME = 200
"""Maximum length of a name, in bytes: files add an ending and a mark while they are written, and
systems limit file names to 255."""

MOST_PATH = 2000
"""Maximum length of a path, in bytes."""

SHORT = 200
"""Maximum length of a quoted message of another library."""

MOST_UNPACKED = 1 << 30
"""Maximum size in memory of arrays with a smaller file, in bytes; those of runs are not
compressed."""

KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a pipe",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
}


class FileError(OSError):
    """A file that is refused because of its kind or size; `strerror` says why."""

    def __init__(self, path: Path, why: str, number: int = errno.EINVAL) -> None:
        super().__init__(number, why, str(path))

    def __str__(self) -> str:
        return str(self.strerror)


BACKSLASH = "Write paths with / in place of \\, on Windows as well"
"""What to do where TOML takes a backslash in quotes for the start of a special character."""

SPECIAL = frozenset("\b\t\n\f\r\x1b")
"""What TOML makes of a backslash and a letter."""


def possible_name(value: str) -> str:
    """The name, if a file can have it. Raises ValueError otherwise."""
    if SPECIAL & set(value):
        raise ValueError(f"is {value[:60]!r}, with special characters in it. {BACKSLASH}")
    lengths = [len(part.encode()) for part in Path(value).parts]
    if "\0" in value or sum(lengths) > MOST_PATH or max(lengths, default=0) > LONGEST_NAME:
        raise ValueError("is no name that a file can have. Shorten it, without letters of no width")
    return value


def check_file(path: Path, most: int | None = MOST_BYTES) -> None:
    """Raise OSError unless this is a regular file of at most `most` bytes.

    A pipe or a device may have no end, and waits for a writer.
    """
    _check(path, os.stat(path), most)


def read_file(path: Path, most: int | None = MOST_BYTES) -> bytes:
    """Content of a regular file of at most `most` bytes. Raises OSError for anything else."""
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
    try:
        found = os.fstat(descriptor)
        _check(path, found, most)
        with open(descriptor, "rb", closefd=False) as file:
            return file.read(found.st_size)
    finally:
        os.close(descriptor)


def read_json(path: Path) -> Any:
    """Content of a JSON file. Raises OSError as `read_file`, ValueError for invalid JSON."""
    return _parsed(path, json.loads)


def read_toml(path: Path) -> dict[str, Any]:
    """Content of a TOML file. Raises OSError as `read_file`, ValueError for invalid TOML."""
    found: dict[str, Any] = _parsed(path, tomllib.loads)
    return found


def read_arrays(path: Path, names: Sequence[str] | None = None) -> dict[str, NDArray[Any]]:
    """Arrays of an .npz file by name.

    names   those to read; all when None
    raises  OSError if the file cannot be opened; ValueError if it is cut, empty or no archive,
            unpacks to more than MOST_UNPACKED, or lacks one of the names
    """
    import numpy as np

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


def _parsed(path: Path, parse: Callable[[str], Any]) -> Any:
    text = read_file(path).decode("utf-8-sig")
    try:
        return parse(text)
    except RecursionError:
        raise ValueError(f"{path.name} is nested hundreds deep") from None


def _check(path: Path, found: os.stat_result, most: int | None) -> None:
    if not stat.S_ISREG(found.st_mode):
        kind = KINDS.get(stat.S_IFMT(found.st_mode), "something else")
        raise FileError(path, f"it is {kind}, and no file")
    if most is not None and found.st_size > most:
        raise FileError(
            path,
            f"it has {found.st_size / 2**20:.4g} MB, and {most / 2**20:g} MB are the most",
            errno.EFBIG,
        )
