"""How long one waits for the first frame: of the very first run, and of later ones."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from flowborne.bench.result import Result, timed, verdict

NAME = "first-run"
SCENE = "ns-block-drag-max"
COMPILING, COMPILED = 60.0, 5.0
"""Seconds that the command may take with nothing compiled, and with everything compiled."""


def measure() -> Iterator[Result]:
    """Seconds of a run of one frame, with an empty cache of kernels and with a full one."""
    with TemporaryDirectory() as folder:
        for state, allowed in (("first run", COMPILING), ("later run", COMPILED)):
            seconds = run_once(SCENE, Path(folder))
            yield Result(
                NAME,
                f"{SCENE}: seconds to the first frame, {state}",
                seconds,
                f"below {allowed:g}",
                verdict(seconds < allowed),
            )


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
