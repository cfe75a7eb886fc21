"""Files named by a user: only regular ones, up to a maximum size."""

from __future__ import annotations

import errno
import json
import os
import stat
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

MOST_BYTES = 1 << 28
"""Maximum size of a file that is read whole, in bytes."""

LONGEST_NAME = 200
"""Maximum length of a name, in bytes: files add an ending and a mark while they are written, and
systems limit file names to 255."""

MOST_PATH = 2000
"""Maximum length of a path, in bytes."""

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


def possible_name(value: str) -> str:
    """The name, if a file can have it. Raises ValueError otherwise."""
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
