"""A run that may still go on: read again when it has new frames."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from flowborne.runs.run_folder import STATE_NAME, RunFolder, RunFolderError
from flowborne.runs.states import read_state
from flowborne.view.run import Run

Array = NDArray[np.float64]


@dataclass(frozen=True)
class GrowingRun(Run):
    """A run as far as it has come; `grown` is the same with the frames that have come since.

    started  ns, when its folder was written first
    kept     name -> what `every` has read of the states, so that it is read once
    """

    started: int = 0
    kept: dict[str, list[NDArray[Any]]] = field(default_factory=dict, repr=False)

    @classmethod
    def opened(cls, path: Path) -> Self:
        """The run in folder `path`.

        raises  RunFolderError when it is none, has no frame yet, or cannot be read
        """
        files = RunFolder.existing(path)
        if not _states(files):
            raise RunFolderError(f"{path} has no frame yet; view it when the run has begun")
        try:
            started = files.model.stat().st_mtime_ns
            return replace(cls.read(path), started=started)
        except (OSError, KeyError, ValueError) as error:
            raise RunFolderError(
                f"{path} cannot be read ({error}); start the run again with --replace"
            ) from error

    def grown(self) -> Self | None:
        """The run with its new frames; None while there are none.

        A run that was started again is another one: `started` tells.
        raises  RunFolderError when it cannot be read, as while it is being replaced
        """
        files = RunFolder(self.states[0].parent.parent)
        if _states(files) == len(self):
            return None
        new = self.opened(files.path)
        if new.continues(self):
            new.kept.update(self.kept)
        return new

    def continues(self, other: GrowingRun) -> bool:
        """Whether it is the same run as `other`, farther on."""
        return self.started == other.started and len(self) >= len(other)

    def every(self, name: str) -> Array:
        """(n, ...) a small array of all states, such as "fluid_force"."""
        values = self.kept.setdefault(name, [])
        for path in self.states[len(values) :]:
            values.append(read_state(path, (name,))[name])
        return np.asarray(values, float)


def _states(files: RunFolder) -> int:
    """Number of states in a run folder."""
    if not files.states.is_dir():
        return 0
    return sum(1 for path in files.states.iterdir() if STATE_NAME.fullmatch(path.name))
