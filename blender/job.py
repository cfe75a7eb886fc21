# SPDX-License-Identifier: GPL-3.0-or-later
"""A run of flowborne as a child process, advanced by calls of `step`."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from time import monotonic

from .process import JobError, Process, State
from .reaction import Reaction, ReactionError, cost_of, write_scene

CHARACTER = "character.glb"
"""The exported character in the folder of a job."""

DOUBTFUL = 3
"""Exit code of a complete run with doubtful results."""

WARNING = "  warning: "
"""Start of the lines with which `flowborne check` warns."""


class Job(Process):
    """A run in a folder: import of `character.glb`, then the run, or a check of its scene.

    Each is a child process.

    engine    command of flowborne
    folder    of the job, with CHARACTER
    reaction  settings
    run       folder of the run
    volumes   stands for flow_0000.vdb and so on, of `start_export`
    """

    def __init__(self, engine: Sequence[str], folder: Path, reaction: Reaction) -> None:
        super().__init__(folder / "log.txt")
        self.engine, self.folder, self.reaction = tuple(engine), folder, reaction
        self.run, self.volumes = folder / "run", folder / "volumes" / "flow.vdb"
        self._scene = folder / "scene" / "reaction.toml"
        self._only_check = False
        self._pace: tuple[float, int] | None = None

    @classmethod
    def load(cls, engine: Sequence[str], folder: Path) -> Job:
        """The job of a folder, also after a restart of Blender. Raises ReactionError without one"""
        job = cls(engine, folder, Reaction.load(folder / "job.json"))
        if job.frames_done:
            job.state = State.DONE if job.complete else State.CANCELLED
        return job

    def start(self, only_check: bool = False) -> None:
        """Start or resume the job, or only import the character and check the scene.

        raises  JobError when it is running, or cannot be started
        """
        if self.active:
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
        for bone in self.reaction.bones if self.reaction.young else ():
            command += ["--flesh", bone]
        self._spawn(State.IMPORTING, [*self.engine, *command])

    def start_export(self) -> None:
        """Start to write the flow of each frame to a volume. Raises JobError like `start`."""
        if self.active:
            raise JobError("the run is in progress: wait for its end, or cancel it")
        if not self.reaction.ink or not self.frames_done:
            raise JobError("this run has no ink: choose an object in Ink, and start a new run")
        self.message = ""
        self.volumes.parent.mkdir(exist_ok=True)
        command = ["export", str(self.run), "--out", str(self.volumes)]
        self._spawn(State.EXPORTING, [*self.engine, *command])

    def step(self) -> State:
        """Look after the child once, without waiting for it, and return the state."""
        if super().step() is State.RUNNING and self._pace is None and self.frames_done:
            self._pace = monotonic(), self.frames_done
        return self.state

    @property
    def frames_done(self) -> int:
        """Frames in the run folder."""
        return max(sum(1 for _ in (self.run / "states").glob("[0-9]*.npz")) - 1, 0)

    @property
    def complete(self) -> bool:
        """Whether the run has all its frames."""
        return self.frames_done >= self.reaction.frames

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
            lines = self._lines() if self.log.exists() else []
            found = [line.removeprefix(WARNING) for line in lines if line.startswith(WARNING)]
            return tuple(dict.fromkeys(found))

    @property
    def cost(self) -> str:
        """Cells, memory and time of a run in a simulated flow; empty in simple wind or before the
        scene is written."""
        simulated = self.reaction.simulated and self._scene.exists()
        return cost_of(self._scene, self.reaction) if simulated else ""

    @property
    def line(self) -> str:
        """The state, the frame, and the time that is left, or the message."""
        if self.message:
            return self.message
        left, said = self.seconds_left, self.state.value
        if self.state is not State.CHECKED:
            said += f", frame {self.frames_done}/{self.reaction.frames}"
        if left is not None:
            return f"{said}, {left:.0f} s left"
        return f"{said}: {self.cost}" if self.cost and not self.complete else said

    def _ended(self, code: int) -> None:
        if code == 0 and self.state is State.IMPORTING:
            self._prepare()
            self._go_on()
        elif code == 0 and self.state is State.CHECKING:
            self.state = State.CHECKED
        elif code == 0 and self.state is State.EXPORTING:
            self.state = State.EXPORTED
        elif code in (0, DOUBTFUL) and self.frames_done:
            self.state, self.message = State.DONE, self._said() if code else ""
        else:
            super()._ended(code)

    def _prepare(self) -> None:
        try:
            write_scene(self.folder / "scene" / "character.toml", self.reaction)
        except ReactionError as error:
            raise JobError(str(error)) from error

    def _go_on(self) -> None:
        """Start the child that comes after the import."""
        if self._only_check:
            self._spawn(State.CHECKING, [*self.engine, "check", str(self._scene)])
            return
        goes_on = "--resume" if (self.run / "checkpoint.npz").exists() else "--replace"
        command = ["run", str(self._scene), "--out", str(self.run), "--no-film", goes_on]
        self._spawn(State.RUNNING, [*self.engine, *command])
