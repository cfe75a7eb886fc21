"""What a bench reports."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any, Literal, TypeVar

T = TypeVar("T")

Verdict = Literal["pass", "fail", "info"]


@dataclass(frozen=True)
class Result:
    """One row: a figure and what was asked of it.

    name     of the bench
    title    what was measured, with its unit
    target   in words; "" where the figure is only for information
    lines    how the figure came about
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


def timed(action: Callable[[], T], repeats: int = 1) -> tuple[T, float]:
    """What an action returns, and the seconds of its quickest run."""
    best = float("inf")
    for _ in range(repeats):
        start = time.perf_counter()
        found = action()
        best = min(best, time.perf_counter() - start)
    return found, best
