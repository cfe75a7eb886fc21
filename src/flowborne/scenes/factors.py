"""Keyframes and intervals of time in the tables of a scene."""

from __future__ import annotations

from typing import Self

from pydantic import model_validator

from flowborne.motion.inflow import FactorKeyframes
from flowborne.motion.tracks import Curve
from flowborne.tables import Number, Table


class FactorsTable(Table):
    """A table whose amount may change in time.

    times    s, keyframes between which `factors` of the amount change smoothly
    factors  of it at these times
    """

    times: tuple[Number, ...] | None = None
    factors: tuple[Number, ...] | None = None

    @model_validator(mode="after")
    def _check_factors(self) -> Self:
        if self.times is not None or self.factors is not None:
            check_table(self.times, self.factors, "times", "factors")
        return self

    def keyframes(self) -> FactorKeyframes | None:
        """The factor in time; None where there are no keyframes."""
        if self.times is None or self.factors is None:
            return None
        return FactorKeyframes(Curve(self.times, self.factors))


def check_table(
    times: tuple[float, ...] | None, values: tuple[float, ...] | None, first: str, second: str
) -> None:
    """Raise ValueError unless both are given, are equally long, and the times increase."""
    if times is None or values is None:
        missing = first if times is None else second
        raise ValueError(f"has no {missing}. Give both {first} and {second}")
    if len(times) != len(values):
        raise ValueError(
            f"has {len(times)} {first} and {len(values)} {second}. Give as many of both"
        )
    if len(times) < 2:
        raise ValueError(f"has {len(times)} {first}. Give at least two")
    for index in range(1, len(times)):
        if times[index] <= times[index - 1]:
            raise ValueError(
                f"has {first} that do not increase: entry {index + 1} is {times[index]:g} s after "
                f"{times[index - 1]:g} s. Put them in order, each once"
            )


def check_interval(start: float, stop: float | None) -> None:
    """Raise ValueError unless something lies between `start` and `stop`."""
    if stop is not None and stop <= start:
        raise ValueError(f"starts at {start:g} s and stops at {stop:g} s. Make stop later")
