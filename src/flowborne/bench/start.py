"""How long the command takes before it does anything."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator

from flowborne.bench.result import Result, timed, verdict

NAME = "start"
ALLOWED = 0.5
"""s."""


def measure() -> Iterator[Result]:
    """Seconds from the command to its help."""
    yield help_told()


def help_told(repeats: int = 5) -> Result:
    """Seconds that `flowborne --help` takes, the quickest time of a few."""
    command = [sys.executable, "-m", "flowborne", "--help"]
    _, seconds = timed(lambda: subprocess.run(command, check=True, capture_output=True), repeats)
    return Result(
        NAME,
        "flowborne --help: seconds from the command to its end",
        seconds,
        f"below {ALLOWED:g}",
        verdict(seconds < ALLOWED),
    )
