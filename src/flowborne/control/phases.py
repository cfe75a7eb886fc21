"""Phases of objectives and strengths: always, at times, or while a motion rises or falls."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Literal, Protocol, Self

from pydantic import Field, model_validator

from flowborne.base.tables import ByKind, Number, Positive, Table, Text
from flowborne.control.surroundings import Surroundings
from flowborne.solids.trajectories import Trajectory

SLACK = 1e-9
"""A time less than this before a boundary, by rounding, has reached it, s."""


class Phases(Protocol):
    """Switches an objective on and off."""

    def active(self, time: float) -> bool:
        """Whether the objective counts at `time` (s)."""
        ...


@dataclass(frozen=True)
class PhaseAlways:
    """Always active."""

    def active(self, time: float) -> bool:
        return True


@dataclass(frozen=True)
class PhaseIntervals:
    """Active in half-open intervals of time.

    intervals  (start, stop) each, s; active at start, not at stop
    period     s; the intervals repeat with it and may wrap around its end. None: no repetition
    raises     ValueError if an interval is empty or longer than the period, or its start is not
               finite
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
    """Active while a prescribed motion is above (or below) a threshold: downstroke, upstroke.

    track      the motion
    quantity   its position (rad, m) or its velocity (rad/s, m/s)
    sign       +1: active while the quantity is at or above the threshold; -1: while it is below,
               so that exactly one of two opposite phases is active
    threshold  rad, m, rad/s or m/s
    column     number of the dof in the motion
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


class PhaseIntervalsTable(Table):
    """Active in intervals.

    intervals  [start, stop] of each, s; active at start, not at stop
    period     s; the intervals repeat with it. No repetition by default
    """

    kind: Literal["intervals"]
    intervals: Annotated[tuple[tuple[Number, Number], ...], Field(min_length=1)]
    period: Positive | None = None

    @model_validator(mode="after")
    def _check(self) -> Self:
        for start, stop in self.intervals:
            if stop <= start:
                raise ValueError(
                    f"has the interval [{start:g}, {stop:g}] s. Put the smaller time first"
                )
            if self.period is not None and stop - start > self.period:
                raise ValueError(
                    f"has the interval [{start:g}, {stop:g}] s, longer than its period of "
                    f"{self.period:g} s. Shorten it"
                )
        return self

    def check(self, around: Surroundings) -> Iterator[str]:
        """Everything that does not fit the scene around it."""
        yield from ()

    def build(self, around: Surroundings) -> PhaseIntervals:
        """The phases that the table describes."""
        return PhaseIntervals(self.intervals, self.period)


class PhaseMotionTable(Table):
    """Active while the position or velocity of a prescribed motion is on one side of a threshold.

    joint      joint of the [[motion]]
    quantity   "velocity" (degrees/s or m/s) or "position" (degrees or m)
    side       "above" (threshold included) or "below"
    threshold  in the unit of the quantity
    """

    kind: Literal["motion"]
    joint: Text
    quantity: Literal["velocity", "position"] = "velocity"
    side: Literal["above", "below"] = "above"
    threshold: Number = 0.0

    def check(self, around: Surroundings) -> Iterator[str]:
        """Everything that does not fit the scene around it."""
        if self.joint not in around.followed and around.read("motion"):
            yield (
                f"joint '{self.joint}' has no [[motion]] to follow. "
                "Add one, or give phases as intervals."
            )

    def build(self, around: Surroundings) -> PhaseTrack:
        """The phases that the table describes."""
        sign = 1 if self.side == "above" else -1
        threshold = around.unit(self.joint) * self.threshold
        return PhaseTrack(around.motion_of(self.joint), self.quantity, sign, threshold)


PhaseTable = Annotated[PhaseIntervalsTable | PhaseMotionTable, *ByKind]
