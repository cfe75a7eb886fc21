"""The frames that were played, as a run that is in memory."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from flowborne.kernels.arrays import Array
from flowborne.play.playing import Moment, Play
from flowborne.runs.history import HistoryColumns
from flowborne.runs.run_folder import RunFolder
from flowborne.scenes.control import objective_unit
from flowborne.sim.running import write_state_alone
from flowborne.view.run import Run, State

MEMORY = 2_000_000_000
"""Bytes of frames that are kept."""


class PlayedRun(Run):
    """What was played: a ring of frames, whose oldest ones are dropped when they take too much.

    Its constant data come from a run folder of the start, as those of any run.

    moments  the frames
    """

    def __init__(self, play: Play, most: int = MEMORY) -> None:
        """The run of a play that starts. `most`: bytes of frames that are kept."""
        first = play.first
        with TemporaryDirectory() as folder:
            path = Path(folder) / play.simulation.scene.name
            write_state_alone(RunFolder(path), play.simulation)
            super().__init__(path)
        scene, model = play.simulation.scene, play.simulation.setup.solid
        wanted = scene.objectives, scene.controlled_joints()
        self.objective_unit = objective_unit(*wanted, model, slab=scene.is_slab)
        self.moments = [first]
        self._bytes, self._most = first.bytes, most
        self._index(np.array([first.row["time_s"]]))
        self.update_history()

    def __len__(self) -> int:
        return len(self.moments)

    def state(self, number: int) -> State:
        return self.moments[number].state

    def every(self, name: str) -> Array:
        return np.asarray([moment.state[name] for moment in self.moments], float)

    def append(self, moment: Moment) -> None:
        """Add the next frame, and drop the oldest ones beyond the memory."""
        self.moments[-1] = self.moments[-1].without_cut()
        self.moments.append(moment)
        self._bytes += moment.bytes
        before = len(self.moments)
        while self._bytes > self._most and len(self.moments) > 2:
            self._bytes -= self.moments.pop(0).bytes
        self._index(np.append(self.times, moment.row["time_s"])[before - len(self.moments) :])

    def cut(self, count: int) -> None:
        """Drop all frames but the first `count`."""
        self._bytes -= sum(moment.bytes for moment in self.moments[count:])
        del self.moments[count:]
        self._index(self.times[:count])

    def update_history(self) -> None:
        """Make the history that of the frames now."""
        rows = [moment.row for moment in self.moments if moment.frame > 0]
        columns = self.moments[-1].row
        self.history = HistoryColumns(
            {name: np.array([row[name] for row in rows]) for name in columns}
        )

    def _index(self, times: Array) -> None:
        """Number the frames from the first one; `times`: (n,) s, of all of them."""
        first = self.moments[0].frame
        self.frames, self.times = range(first, first + len(self.moments)), times
