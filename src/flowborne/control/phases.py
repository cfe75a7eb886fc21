"""When an objective counts, or a strength: always, at times, or while a track rises or falls."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, Protocol

from flowborne.coupling.motion import Trajectory

SLACK = 1e-9
"""s; a time that rounding has left this far before a boundary counts as having reached it."""


class Phases(Protocol):
    """Switches an objective on and off."""

    def active(self, time: float) -> bool:
        """Whether the objective counts at `time` (s)."""
        ...


@dataclass(frozen=True)
class PhaseAlways:
    """On for all time."""

    def active(self, time: float) -> bool:
        return True


@dataclass(frozen=True)
class PhaseIntervals:
    """On in half-open intervals of time.

    intervals  (start, stop) each, s; on from start until just before stop
    period     s; the intervals repeat with it and may wrap around its end. None: they come once
    raises     ValueError when an interval is empty or not finite at its start, or when it is
               longer than the period
    """

    intervals: tuple[tuple[float, float], ...]
    period: float | None = None

    def __post_init__(self) -> None:
        if self.period is not None and not 0.0 < self.period < math.inf:
            raise ValueError(f"phase period is {self.period} s: give a positive number of seconds")
        longest = math.inf if self.period is None else self.period
        for start, stop in self.intervals:
            if not (math.isfinite(start) and start < stop <= start + longest):
                raise ValueError(
                    f"phase interval ({start}, {stop}) s with period {self.period}: "
                    "it must start before it stops and be no longer than the period"
                )

    def active(self, time: float) -> bool:
        return any(self._inside(time + SLACK, start, stop) for start, stop in self.intervals)

    def _inside(self, time: float, start: float, stop: float) -> bool:
        since = time - start
        if self.period is not None:
            since %= self.period
        return 0.0 <= since < stop - start


@dataclass(frozen=True)
class PhaseTrack:
    """On while a prescribed motion is above (or below) a threshold: downstroke, upstroke.

    track      the motion
    quantity   its position (rad, m) or its velocity (rad/s, m/s)
    sign       +1: on while the quantity is at or above the threshold; -1: on while it is below,
               so that of two opposite phases exactly one is on
    threshold  rad, m, rad/s or m/s
    column     which dof of the motion
    raises     ValueError for another sign or quantity
    """

    track: Trajectory
    quantity: Literal["position", "velocity"] = "velocity"
    sign: int = 1
    threshold: float = 0.0
    column: int = 0

    def __post_init__(self) -> None:
        if self.sign not in (-1, 1):
            raise ValueError(f"phase sign is {self.sign}: give 1 (above) or -1 (below)")
        if self.quantity not in ("position", "velocity"):
            raise ValueError(f"phase quantity is {self.quantity!r}: give 'position' or 'velocity'")

    def active(self, time: float) -> bool:
        read = self.track.position if self.quantity == "position" else self.track.velocity
        above = float(read(time)[self.column]) >= self.threshold
        return above == (self.sign > 0)
