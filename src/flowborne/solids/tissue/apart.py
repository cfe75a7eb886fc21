"""Work on meshes in a process of its own, which may die."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from flowborne.solids.tissue import mesh_run


def run_apart(folder: str, made: str, job: str, *arguments: str) -> str | None:
    """Do a job of `mesh_run` in a folder; why it failed to make the file `made`, or None.

    fTetWild may end its process with 0 before there is a mesh.
    """
    # -P: no module of this folder stands in for one of Python's own
    command = [sys.executable, "-P", str(Path(mesh_run.__file__).resolve()), job, *arguments]
    run = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if run.returncode == 0 and (Path(folder) / made).is_file():
        return None
    said = [line.strip() for line in (run.stdout + run.stderr).splitlines() if line.strip()]
    died = run.returncode < 0 or not said
    return f"it ended with {run.returncode}" if died else said[-1].rstrip(".")
