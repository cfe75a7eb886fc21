"""Another process that reads a file: a damaged file may crash its reader or fill the memory, and no
check in the same process prevents it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from flowborne.base.errors import SceneError
from flowborne.characters.limits import MAX_FILE_BYTES

MAX_MEMORY = 8 << 30
"""Limit of the address space of that process, bytes; Windows has no such limit."""

MAX_SECONDS = 300.0
"""Time limit of that process, s."""


def run_apart(module: str, kind: str, path: Path, *more: str) -> tuple[int, str]:
    """Exit status of a module, run as a program on a file, and the text that it writes.

    kind    of the file, for messages
    more    arguments after the file
    raises  SceneError when it takes too long
    """
    try:
        done = subprocess.run(
            [sys.executable, "-P", "-m", module, str(path.absolute()), *more],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            timeout=MAX_SECONDS,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise SceneError(
            f"{path.name} cannot be read as {kind} within {MAX_SECONDS:g} s. Export a smaller "
            "character."
        ) from None
    return done.returncode, done.stdout.decode(errors="replace")


def limit_memory() -> None:
    """Limit the memory of this process, and write no core file when it crashes."""
    if sys.platform != "win32":
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MAX_MEMORY, MAX_MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def check_bytes(size: int, where: str) -> None:
    """Raise SceneError for a file that is too large."""
    if size > MAX_FILE_BYTES:
        raise SceneError(
            f"{where} has {size / 2**30:.3g} GB; the maximum is {MAX_FILE_BYTES / 2**30:g} GB. "
            "Export fewer meshes and clips."
        )
