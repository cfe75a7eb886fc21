# SPDX-License-Identifier: GPL-3.0-or-later
"""A run of flowborne as a child process, advanced by calls of `step`."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Sequence
from enum import Enum
from pathlib import Path
from time import monotonic

from .reaction import Reaction, ReactionError, cost_of, write_scene

CHARACTER = "character.glb"
"""The exported character in the folder of a job."""

GRACE_SECONDS = 10.0
"""Time in which a cancelled child saves its last frame before it is killed."""

DOUBTFUL = 3
"""Exit code of a complete run with doubtful results."""

MESSAGE_LINES = 4
"""Last lines of the log that are shown when a child fails."""

WARNING = "  warning: "
"""Start of the lines with which `flowborne check` warns."""


class JobError(Exception):
    """A job cannot start; the text says why and what to do."""


class State(Enum):
    """What a job does."""

    NEW = "not started"
    IMPORTING = "dividing the character into bodies"
    CHECKING = "checking the scene"
    CHECKED = "checked"
    RUNNING = "running"
    STOPPING = "stopping"
    CANCELLED = "cancelled"
    FAILED = "failed"
    DONE = "done"


ACTIVE = (State.IMPORTING, State.CHECKING, State.RUNNING, State.STOPPING)
"""States in which a child runs."""


def engine_command(place: str) -> tuple[str, ...]:
    """The command of flowborne in an environment.

    place   folder of the environment, its Python, or its program `flowborne`
    raises  JobError when there is none
    """
    path = Path(place).expanduser()
    if path.is_dir():
        inside = ("bin/python", "Scripts/python.exe", "bin/flowborne", "Scripts/flowborne.exe")
        path = next((path / name for name in inside if (path / name).is_file()), path)
    if not place or not path.is_file():
        raise JobError(
            f"there is no flowborne in '{place}'. Make an environment (python -m venv flowborne), "
            "install flowborne in it, and name its folder in the preferences of the extension"
        )
    return (str(path),) if path.stem == "flowborne" else (str(path), "-m", "flowborne")


class Job:
    """A run in a folder: import of `character.glb`, then the run, or a check of its scene.

    Each is a child process.

    engine    command of flowborne
    folder    of the job, with CHARACTER
    reaction  settings
    state     see State
    message   for the user: why the job failed, or what is doubtful
    """

    def __init__(self, engine: Sequence[str], folder: Path, reaction: Reaction) -> None:
        self.engine, self.folder, self.reaction = tuple(engine), folder, reaction
        self.state, self.message = State.NEW, ""
        self.run = folder / "run"
        self._scene = folder / "scene" / "reaction.toml"
        self._log = folder / "log.txt"
        self._child: subprocess.Popen[bytes] | None = None
        self._log_start = 0
        self._deadline = 0.0
        self._only_check = False
        self._pace: tuple[float, int] | None = None

    @classmethod
    def load(cls, engine: Sequence[str], folder: Path) -> Job:
        """The job of a folder, also after a restart of Blender. Raises ReactionError without one"""
        job = cls(engine, folder, Reaction.load(folder / "job.json"))
        if job.frames_done:
            complete = job.frames_done >= job.reaction.frames
            job.state = State.DONE if complete else State.CANCELLED
        return job

    def start(self, only_check: bool = False) -> None:
        """Start or resume the job, or only import the character and check the scene.

        raises  JobError when it is running, or cannot be started
        """
        if self.state in ACTIVE:
            raise JobError("the run is in progress: wait for its end, or cancel it")
        self.message, self._pace, self._only_check = "", None, only_check
        if self._scene.exists():
            self._go_on()
            return
        scene = self.folder / "scene"
        (scene / "character.toml").unlink(missing_ok=True)  # of an import that was killed
        self.reaction.save(self.folder / "job.json")
        size = ["--density", str(self.reaction.density), "--scale", str(self.reaction.unit)]
        command = ["import", str(self.folder / CHARACTER), "--out", str(scene), "--fill", *size]
        self._spawn(State.IMPORTING, command)

    def step(self) -> State:
        """Look after the child once, without waiting for it, and return the state."""
        if self._child is None:
            return self.state
        code = self._child.poll()
        if code is None:
            if self.state is State.STOPPING and monotonic() > self._deadline:
                self._child.kill()
            elif self._pace is None and self.frames_done:
                self._pace = monotonic(), self.frames_done
            return self.state
        self._child = None
        if code == 0 and self.state is State.IMPORTING:
            self._prepare()
        elif code == 0 and self.state is State.CHECKING:
            self.state = State.CHECKED
        elif code in (0, DOUBTFUL) and self.state is not State.CHECKING:
            self.state, self.message = State.DONE, self._said() if code else ""
        elif self.state is State.STOPPING:
            self.state = State.CANCELLED
        else:
            said = self._said()
            self.state, self.message = State.FAILED, said or f"flowborne ended with code {code}"
        return self.state

    def cancel(self) -> None:
        """Ask the child to save its last frame and to end; `step` then kills one that does not."""
        if self._child is not None and self.state is not State.STOPPING:
            self.state, self._deadline = State.STOPPING, monotonic() + GRACE_SECONDS
            self._child.terminate()

    def close(self) -> None:
        """End the child at once; for when Blender quits."""
        if self._child is not None:
            self._child.kill()
            self._child.wait()
            self._child, self.state = None, State.CANCELLED

    @property
    def frames_done(self) -> int:
        """Frames in the run folder."""
        return max(sum(1 for _ in (self.run / "states").glob("[0-9]*.npz")) - 1, 0)

    @property
    def seconds_left(self) -> float | None:
        """Estimate from the frames so far; None before there are two, or when nothing runs."""
        if self.state is not State.RUNNING or self._pace is None:
            return None
        since, first = self._pace
        if self.frames_done <= first:
            return None
        left = self.reaction.frames - self.frames_done
        return (monotonic() - since) / (self.frames_done - first) * left

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about the scene, such as bodies that are thinner than two cells.

        They are those of the run's summary, or of the last check.
        """
        try:
            summary = json.loads((self.run / "summary.json").read_text(encoding="utf-8"))
            return tuple(map(str, summary.get("warnings", ())))
        except (OSError, ValueError):
            lines = self._lines(0) if self._log.exists() else []
            found = [line.removeprefix(WARNING) for line in lines if line.startswith(WARNING)]
            return tuple(dict.fromkeys(found))

    @property
    def cost(self) -> str:
        """Cells, memory and time of a run in a simulated flow; empty in simple wind or before the
        scene is written."""
        simulated = self.reaction.simulated and self._scene.exists()
        return cost_of(self._scene, self.reaction) if simulated else ""

    def _prepare(self) -> None:
        try:
            write_scene(self.folder / "scene" / "character.toml", self.reaction)
            self._go_on()
        except (ReactionError, JobError) as error:
            self.state, self.message = State.FAILED, str(error)

    def _go_on(self) -> None:
        """Start the child that comes after the import."""
        if self._only_check:
            self._spawn(State.CHECKING, ["check", str(self._scene)])
            return
        goes_on = "--resume" if (self.run / "checkpoint.npz").exists() else "--replace"
        command = ["run", str(self._scene), "--out", str(self.run), "--no-film", goes_on]
        self._spawn(State.RUNNING, command)

    def _spawn(self, state: State, arguments: list[str]) -> None:
        """Start a child; what it prints goes to the log."""
        try:
            with self._log.open("ab") as log:
                self._log_start = log.tell()
                self._child = subprocess.Popen(
                    [*self.engine, *arguments],
                    stdin=subprocess.DEVNULL,
                    stdout=log,
                    stderr=subprocess.STDOUT,
                    env=os.environ | {"PYTHONIOENCODING": "utf-8"},
                    creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
                )
        except OSError as error:
            self.state = State.FAILED
            raise JobError(f"{self.engine[0]} cannot be started: {error}") from error
        self.state = state

    def _said(self) -> str:
        """The last lines that the last child has printed."""
        lines = [line.strip() for line in self._lines(self._log_start) if line.strip()]
        return "\n".join(lines[-MESSAGE_LINES:])

    def _lines(self, start: int) -> list[str]:
        """Lines of the log from a byte on."""
        with self._log.open("rb") as log:
            log.seek(start)
            return log.read().decode("utf-8", "replace").splitlines()
