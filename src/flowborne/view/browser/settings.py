"""The state of the controls: what is shown, and at which time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Settings:
    """What is shown of a state.

    field     "dye", "vorticity" or "none"; of a slab also "speed" and "pressure"
    slice     "speed", "pressure" or "none", in space
    axis      number of the axis across which the slice is
    place     m, where on it
    velocity  whether the velocity in the slice is shown, in a slab that of all
    bones     whether flesh is seen through, to the bones in it
    forces    whether the forces on the bodies are shown
    follow    whether the view goes along with the bodies
    """

    field: str = "none"
    slice: str = "none"
    axis: int = 1
    place: float = 0.0
    velocity: bool = False
    bones: bool = False
    forces: bool = True
    follow: bool = True


Array = NDArray[np.float64]


class Timeline:
    """A place in the time of a run, which goes on by itself while it plays.

    times    (n,) s of the states, ascending
    time     s, that is seen
    playing  whether it goes on
    pace     s of the run in a second
    newest   whether the last state is seen, also when there are new ones
    """

    def __init__(self, times: Array) -> None:
        self.times = times
        self.time = float(times[0])
        self.playing = False
        self.pace = 1.0
        self.newest = False

    @property
    def number(self) -> int:
        """Of the state that is nearest to the time; of two as near the earlier one."""
        return int(np.abs(self.times - self.time).argmin())

    def seek(self, time: float) -> None:
        """See another time, and stay there."""
        self.time = float(np.clip(time, self.times[0], self.times[-1]))
        self.playing = self.newest = False

    def step(self, states: int) -> None:
        """See a state so many farther on."""
        self.seek(self.times[np.clip(self.number + states, 0, len(self.times) - 1)])

    def play(self) -> None:
        """Go on from here, from the start when this is the end; or stop here."""
        self.playing, self.newest = not self.playing, False
        if self.playing and self.time >= self.times[-1]:
            self.time = float(self.times[0])

    def advance(self, seconds: float) -> None:
        """Let so many seconds go by. At the end it begins again."""
        if self.playing:
            time = self.time + self.pace * seconds
            self.time = float(time if time <= self.times[-1] else self.times[0])

    def extend(self, times: Array) -> None:
        """Take the times (n,) of a run that has come farther."""
        self.times = times
        if self.newest:
            self.time = float(times[-1])

    def show_newest(self) -> None:
        """See the last state, and stay with it when there are new ones."""
        self.time, self.playing, self.newest = float(self.times[-1]), False, True
