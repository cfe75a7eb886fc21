"""Binary USD files, read once in a process of its own: a damaged one can end the process that reads
it, and no check in that process helps."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from flowborne.errors import SceneError

LONGEST = 300.0
"""s that reading may take."""

PROCESS = "flowborne.characters.usd_process"
"""Module that reads the file and ends."""


def probe(path: Path) -> None:
    """Raise SceneError unless a file can be read without harm."""
    command = [sys.executable, "-P", "-m", PROCESS, str(path)]
    nowhere = subprocess.DEVNULL
    try:
        done = subprocess.run(
            command, stdin=nowhere, stdout=nowhere, stderr=nowhere, timeout=LONGEST, check=False
        )
    except subprocess.TimeoutExpired:
        raise SceneError(
            f"{path.name} cannot be read as USD within {LONGEST:g} s. Export a smaller character."
        ) from None
    if done.returncode:
        raise SceneError(
            f"{path.name} cannot be read as USD: it ends the program that reads it. Export it anew."
        )
