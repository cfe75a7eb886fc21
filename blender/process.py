# SPDX-License-Identifier: GPL-3.0-or-later
"""Child processes, one after the other, advanced by calls of `step`."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Sequence
from enum import Enum
from pathlib import Path
from time import monotonic

GRACE_SECONDS = 10.0
"""Time in which a cancelled child saves its last frame before it is killed."""

MESSAGE_LINES = 4
"""Last lines of the log that are shown when a child fails."""


class JobError(Exception):
    """A job cannot start; the text says why and what to do."""


class State(Enum):
    """What a job does."""

    NEW = "not started"
    CREATING = "making an environment"
    INSTALLING = "installing flowborne"
    TRYING = "starting flowborne"
    IMPORTING = "dividing the character into bodies"
    CHECKING = "checking the scene"
    CHECKED = "checked"
    RUNNING = "running"
    EXPORTING = "writing volumes"
    EXPORTED = "volumes written"
    STOPPING = "stopping"
    CANCELLED = "cancelled"
    FAILED = "failed"
    DONE = "done"


IDLE = (State.NEW, State.CHECKED, State.EXPORTED, State.CANCELLED, State.FAILED, State.DONE)
"""States in which no child runs."""


class Process:
    """Child processes of which each follows when the one before has ended.

    log      file with what they print
    state    see State
    message  for the user: why a child failed, or what is doubtful
    """

    def __init__(self, log: Path) -> None:
        self.log, self.state, self.message = log, State.NEW, ""
        self._child: subprocess.Popen[bytes] | None = None
        self._log_start = 0
        self._deadline = 0.0

    @property
    def active(self) -> bool:
        """Whether a child runs."""
        return self.state not in IDLE

    @property
    def line(self) -> str:
        """The state, or the message, for the user."""
        return self.message or self.state.value

    def step(self) -> State:
        """Look after the child once, without waiting for it, and return the state."""
        if self._child is None:
            return self.state
        code = self._child.poll()
        if code is not None:
            self._child = None
            try:
                self._ended(code)
            except JobError as error:
                self.state, self.message = State.FAILED, str(error)
        elif self.state is State.STOPPING and monotonic() > self._deadline:
            self._child.kill()
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

    def _ended(self, code: int) -> None:
        """What follows a child: here, the end of one that was cancelled or has failed."""
        if self.state is State.STOPPING:
            self.state = State.CANCELLED
        else:
            self.state, self.message = State.FAILED, self._said() or f"it ended with code {code}"

    def _spawn(self, state: State, command: Sequence[str]) -> None:
        """Start a child. Raises JobError when it cannot be started."""
        try:
            with self.log.open("ab") as log:
                self._log_start = log.tell()
                self._child = subprocess.Popen(
                    command,
                    stdin=subprocess.DEVNULL,
                    stdout=log,
                    stderr=subprocess.STDOUT,
                    env=os.environ | {"PYTHONIOENCODING": "utf-8"},
                    creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
                )
        except OSError as error:
            self.state = State.FAILED
            raise JobError(f"{command[0]} cannot be started: {error}") from error
        self.state = state

    def _said(self, most: int = MESSAGE_LINES) -> str:
        """The last lines that the last child has printed."""
        lines = [line.strip() for line in self._lines(self._log_start) if line.strip()]
        return "\n".join(lines[-most:])

    def _lines(self, start: int = 0) -> list[str]:
        """Lines of the log from a byte on."""
        with self.log.open("rb") as log:
            log.seek(start)
            return log.read().decode("utf-8", "replace").splitlines()
