"""Seconds until the command gives its help, and until the first frame of a run."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from flowborne_validation.bench.timing import Result, timed, verdict

HELP = 0.5
COMPILING, COMPILED = 60.0, 5.0
"""Most seconds of `--help`, and of a run of one frame with nothing and with everything compiled."""


def start(repeats: int = 5) -> Iterator[Result]:
    """Seconds that `flowborne --help` takes, the quickest time of a few."""
    command = [sys.executable, "-m", "flowborne", "--help"]
    _, seconds = timed(lambda: subprocess.run(command, check=True, capture_output=True), repeats)
    yield below("start", "flowborne --help: seconds from the command to its end", seconds, HELP)


def first_run(scene: str = "ns-block-drag-max") -> Iterator[Result]:
    """Seconds of a run of one frame, with an empty cache of kernels and with a full one."""
    with TemporaryDirectory() as folder:
        for state, allowed in (("first run", COMPILING), ("later run", COMPILED)):
            title = f"{scene}: seconds to the first frame, {state}"
            yield below("first-run", title, run_once(scene, Path(folder)), allowed)


def below(name: str, title: str, seconds: float, allowed: float) -> Result:
    """A time that has to be shorter than allowed."""
    return Result(name, title, seconds, f"below {allowed:g}", verdict(seconds < allowed))


def run_once(scene: str, folder: Path) -> float:
    """Seconds of the command, from its start to its end after one frame.

    folder  keeps the compiled kernels, and the run
    """
    command = [sys.executable, "-m", "flowborne", "run", scene, "--frames", "1", "--no-film"]
    command += ["--replace", "--out", str(folder / "run")]
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder / "kernels")}
    _, seconds = timed(
        lambda: subprocess.run(command, env=environment, check=True, capture_output=True)
    )
    return seconds
