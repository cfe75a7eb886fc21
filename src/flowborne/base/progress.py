"""Telling a person how a run is getting on: a bar on a terminal, lines elsewhere."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from time import monotonic
from typing import Literal

from rich.console import Console
from rich.progress import BarColumn, SpinnerColumn, TextColumn, TimeRemainingColumn
from rich.progress import Progress as Bar

Stage = Literal["clip", "start", "compiling", "frame", "film", "member"]

COMPILING = "compiling kernels (first run only) …"

LINE_SECONDS = 10.0
"""How often a line is written where there is no terminal."""


@dataclass(frozen=True)
class RunProgress:
    """News of a run.

    stage      "clip" (before each run of a batch), "start" (once), "compiling" (at every kernel),
               "frame" (after every frame), "film" (after every frame drawn), "member" (after every
               run of a study)
    frame      frames done, or drawn; runs finished
    frames     frames wanted, or runs
    seconds    since the run began
    kernels    number of kernels compiled so far
    warnings   number of warnings about the scene
    objective  after the frame; nan where there is none
    unit       of the objective, "" where its terms have several
    joints     (column of the history, rad or m) of each controlled joint
    clip       which run of a batch begins; "" in other stages
    """

    stage: Stage
    frame: int
    frames: int
    seconds: float
    kernels: int = 0
    warnings: int = 0
    objective: float = math.nan
    unit: str = ""
    joints: tuple[tuple[str, float], ...] = ()
    clip: str = ""


Progress = Callable[[RunProgress], None]
"""What is called with each piece of news."""


class ProgressDisplay:
    """Shows `RunProgress` on standard error; call it with each piece of news, inside a `with`."""

    def __init__(self) -> None:
        self._stream = sys.stderr
        self._bar: Bar | None = None
        self._started_at = 0
        self._first: float | None = None
        self._line_due = 0.0
        self._said_compiling = False

    def __enter__(self) -> ProgressDisplay:
        if self._stream.isatty():
            self._bar = Bar(
                SpinnerColumn(),
                TextColumn("{task.description}", markup=False),
                BarColumn(bar_width=24),
                TimeRemainingColumn(),
                console=Console(file=self._stream),
            )
            self._task = self._bar.add_task("starting …", total=None)
            self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.stop()

    def __call__(self, news: RunProgress) -> None:
        if news.stage == "clip":
            self.say(news.clip)
        if news.stage == "start":
            self._started_at, self._first = news.frame, None
            if news.warnings:
                self.say(f"warnings: {news.warnings}; flowborne check lists them")
        if news.stage == "frame" and self._first is None:
            self._first = news.seconds
            self.say(f"first frame after {news.seconds:.1f} s")
        if news.stage == "compiling" and not self._said_compiling:
            self._said_compiling = True
            self.say(COMPILING)
        if self._bar is not None:
            self._bar.update(
                self._task,
                description=self.line(news),
                total=None if news.stage in ("clip", "start", "compiling") else news.frames,
                completed=news.frame,
            )
        elif news.stage in ("frame", "film", "member"):
            last = news.frame == news.frames
            if monotonic() >= self._line_due or last:
                self._line_due = monotonic() + LINE_SECONDS
                self.say(self.line(news))

    def line(self, news: RunProgress) -> str:
        """The news in one line."""
        if news.stage in ("clip", "start"):
            return "starting …"
        if news.stage == "compiling":
            return f"{COMPILING} {news.kernels} kernels, {news.seconds:.0f} s"
        if news.stage == "film":
            return f"drawing the film …  frame {news.frame}/{news.frames}"
        if news.stage == "member":
            return f"run {news.frame}/{news.frames}"
        words = [f"frame {news.frame}/{news.frames}"]
        if not math.isnan(news.objective):
            words.append(f"objective {news.objective:.4g} {news.unit}".rstrip())
        words += [_position(column, value) for column, value in news.joints[:3]]
        done = news.frame - self._started_at - 1
        if done > 0 and self._first is not None and self._bar is None:
            pace = (news.seconds - self._first) / done
            words.append(f"{pace * (news.frames - news.frame):.0f} s left")
        return "  ".join(words)

    def say(self, text: str) -> None:
        """A line that stays."""
        if self._bar is not None:
            self._bar.console.print(text, markup=False, highlight=False)
        else:
            print(text, file=self._stream, flush=True)


@contextmanager
def displayed(progress: Progress | bool | None) -> Iterator[Progress | None]:
    """Context with what is to be called with each piece of news: a new display for True."""
    if progress is True:
        with ProgressDisplay() as display:
            yield display
    else:
        yield progress or None


def _position(column: str, value: float) -> str:
    """Where a joint is, with its name, in degrees or metres as its column says."""
    kind, rest = column.split("_", 1)
    name, _ = rest.rsplit("_", 1)
    return f"{name} {math.degrees(value):.1f}°" if kind == "angle" else f"{name} {value:.4g} m"
