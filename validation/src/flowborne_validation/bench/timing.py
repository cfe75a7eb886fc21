"""What a bench reports, and how it times."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass, field
from typing import Any, Literal, TypeVar

import numpy as np

from flowborne import Array, Scene, Simulation
from flowborne.machine import kernel_threads

T = TypeVar("T")

Verdict = Literal["pass", "fail", "info"]

FRAMES = 24
"""Number of timed frames, unless a bench has another one."""


@dataclass(frozen=True)
class Result:
    """One row: a figure and its target.

    name     of the bench
    title    measured quantity, with its unit
    target   in words; "" where the figure is only for information
    lines    details of the measurement
    seconds  that the measurement took
    """

    name: str
    title: str
    value: float
    target: str
    verdict: Verdict
    lines: list[str] = field(default_factory=list)
    seconds: float = 0.0

    def as_dict(self) -> dict[str, Any]:
        """Ready for JSON."""
        return asdict(self)


def verdict(met: bool) -> Verdict:
    """Of a figure with a target."""
    return "pass" if met else "fail"


def info(name: str, title: str, value: float, lines: list[str]) -> Result:
    """A figure without a target."""
    return Result(name, title, value, "", "info", lines)


def at_least(name: str, title: str, value: float, bound: float, lines: list[str]) -> Result:
    """A figure that has to reach a bound."""
    return Result(name, title, value, f"at least {bound:g}", verdict(value >= bound), lines)


def at_most(name: str, title: str, value: float, bound: float, lines: list[str]) -> Result:
    """A figure that may not exceed a bound."""
    return Result(name, title, value, f"at most {bound:g}", verdict(value <= bound), lines)


def timed(action: Callable[[], T], repeats: int = 1) -> tuple[T, float]:
    """Result of the last call of an action, and the seconds of its quickest call."""
    best = float("inf")
    for _ in range(repeats):
        start = time.perf_counter()
        found = action()
        best = min(best, time.perf_counter() - start)
    return found, best


def frame_times(simulations: Sequence[Simulation], frames: int = FRAMES) -> Array:
    """(len(simulations), frames) seconds of every frame after a first one that is not timed.

    The simulations take turns, so that other load of the machine affects all of them alike.
    """
    times = np.empty((len(simulations), frames))
    with kernel_threads(1):
        for simulation in simulations:
            simulation.advance_frame()
        for frame in range(frames):
            for n, simulation in enumerate(simulations):
                times[n, frame] = simulation.advance_frame().seconds["total"]
    return times


def times_together(runs: Sequence[tuple[Scene, int, str]], frames: int = FRAMES) -> Array:
    """`frame_times` of scenes, each with a number of workers and their executor."""
    with ExitStack() as stack:
        return frame_times([stack.enter_context(Simulation(*run)) for run in runs], frames)


def in_words(times: Array) -> str:
    """Quickest and median frame in words."""
    return f"{1e3 * times.min():.1f} ms a frame, {1e3 * np.median(times):.1f} ms in the median"
