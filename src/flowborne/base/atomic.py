"""Files written atomically: whole or not at all."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, BinaryIO


def partial_name(name: str) -> str:
    """Temporary name of a file called `name`, until it is complete."""
    return f".{name}.partial"


def write_atomically(
    path: Path, write: Callable[[BinaryIO], object], *, durable: bool = True
) -> None:
    """Write a file that other processes see either whole or not at all.

    path     of the file; an existing one is replaced atomically
    write    receives the open binary file
    durable  wait until the file is on the disc, so that it survives a power failure, not only the
             death of the process
    raises   errors of `write`, and OSError; the partial file is then removed and `path` unchanged
    """
    partial = path.with_name(partial_name(path.name))
    partial.unlink(missing_ok=True)  # of a killed run; or a link, or a pipe
    try:
        with open(partial, "xb") as file:
            write(file)
            if durable:
                file.flush()
                os.fsync(file.fileno())
        os.replace(partial, path)
    except BaseException:
        partial.unlink(missing_ok=True)
        raise
    if durable:
        sync_folder(path.parent)


@contextmanager
def replaced_whole(path: Path) -> Iterator[Path]:
    """Context with the path of a file to write, which then replaces `path`.

    It has the name of `path`, in a temporary folder next to it.
    """
    with TemporaryDirectory(dir=path.absolute().parent, prefix=f".{path.name}.") as folder:
        new = Path(folder) / path.name
        yield new
        os.replace(new, path)


def write_text(path: Path, text: str) -> None:
    """Write `text` in UTF-8, whole or not at all."""
    write_atomically(path, lambda file: file.write(text.encode()))


def write_json(path: Path, value: Any) -> None:
    """Write `value` as JSON, whole or not at all; raises ValueError when it holds a NaN."""
    write_text(path, json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False) + "\n")


def sync_files(paths: Sequence[Path]) -> None:
    """Wait until files of one folder, and their names, are on the disc."""
    for path in paths:
        with open(path, "rb+") as file:
            os.fsync(file.fileno())
    if paths:
        sync_folder(paths[0].parent)


def sync_folder(path: Path) -> None:
    """Wait until the names in a folder are on the disc (where the system can do that)."""
    if os.name != "posix":
        return
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
