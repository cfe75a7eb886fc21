"""The state of the controls: what is shown, and at which time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne.kernels.arrays import Array


@dataclass(frozen=True)
class Settings:
    """What is shown of a state.

    field       "dye", "vorticity" or "none"; of a slab also "speed" and "pressure"
    slice       "speed", "pressure" or "none", in space
    axis        number of the axis normal to the slice
    coordinate  coordinate of the slice on that axis, m
    velocity    whether the velocity is shown, in 3D in the slice
    bones       whether flesh is transparent to show its bones
    forces      whether the forces on the bodies are shown
    follow      whether the view follows the bodies
    ghost       "none", "in place" or "beside": where the input motion is shown, if it is played
    """

    field: str = "none"
    slice: str = "none"
    axis: int = 1
    coordinate: float = 0.0
    velocity: bool = False
    bones: bool = False
    forces: bool = True
    follow: bool = True
    ghost: str = "none"


class Timeline:
    """The current time of a run, which advances while it plays.

    times    (n,) s of the states, ascending
    time     s, current time
    playing  whether it advances
    pace     seconds of the run per second
    newest   whether the last state is shown, also after new ones arrive
    """

    def __init__(self, times: Array) -> None:
        self.times = times
        self.time = float(times[0])
        self.playing = False
        self.pace = 1.0
        self.newest = False

    @property
    def number(self) -> int:
        """Number of the state nearest to the time; the earlier one of two equally near."""
        return int(np.abs(self.times - self.time).argmin())

    def seek(self, time: float) -> None:
        """Set the time and stop."""
        self.time = float(np.clip(time, self.times[0], self.times[-1]))
        self.playing = self.newest = False

    def step(self, states: int) -> None:
        """Move by a number of states and stop."""
        self.seek(self.times[np.clip(self.number + states, 0, len(self.times) - 1)])

    def play(self) -> None:
        """Play from the current time, or from the start if it is the end; stop if playing."""
        self.playing, self.newest = not self.playing, False
        if self.playing and self.time >= self.times[-1]:
            self.time = float(self.times[0])

    def advance(self, seconds: float) -> None:
        """Advance the time if playing, by seconds of real time; start again at the end."""
        if self.playing:
            time = self.time + self.pace * seconds
            self.time = float(time if time <= self.times[-1] else self.times[0])

    def extend(self, times: Array) -> None:
        """Update the times (n,) to those of a run with new frames."""
        self.times = times
        if self.newest:
            self.time = float(times[-1])

    def show_newest(self) -> None:
        """Show the last state, also after new ones arrive."""
        self.time, self.playing, self.newest = float(self.times[-1]), False, True
