"""Figures of a flow that sheds vortices: means, extremes and frequency over whole periods."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne import Array


@dataclass(frozen=True)
class Shedding:
    """Coefficients of a flow that sheds vortices, step by step over some periods.

    dt                s
    drag, lift, drop  (n,) coefficients, and pressure drop in Pa
    """

    dt: float
    drag: Array
    lift: Array
    drop: Array

    def rises(self) -> Array:
        """Times at which the lift rises through its mean, s."""
        lift = self.lift - self.lift.mean()
        at = np.flatnonzero((lift[:-1] <= 0.0) & (lift[1:] > 0.0))
        return self.dt * (at + lift[at] / (lift[at] - lift[at + 1]))

    def last(self, periods: int) -> tuple[slice, float]:
        """The steps of the last whole periods, and the length of one in s.

        Raises ArithmeticError when there are not so many.
        """
        rises = self.rises()
        if rises.size <= periods:
            raise ArithmeticError(f"the lift rises {rises.size} times, {periods + 1} are needed")
        start, stop = rises[-1 - periods], rises[-1]
        steps = slice(round(start / self.dt), round(stop / self.dt))
        return steps, float((stop - start) / periods)

    def unsteadiness(self, periods: int) -> str:
        """How far the flow is from repeating itself, for people."""
        steps, period = self.last(periods)
        count = round(period / self.dt)
        one, other = (
            amplitude(part) for part in (self.lift[steps][:count], self.lift[steps][-count:])
        )
        return f"lift's amplitude {one:.4f} in the first period, {other:.4f} in the last"


def crest(values: Array) -> tuple[float, float]:
    """Largest value and where it is, in steps: vertex of the parabola through three samples."""
    at = int(np.argmax(values[1:-1])) + 1
    before, here, after = values[at - 1 : at + 2]
    bend = before - 2.0 * here + after
    shift = 0.5 * (before - after) / bend if bend < 0.0 else 0.0
    return float(here - 0.25 * (before - after) * shift), at + float(shift)


def amplitude(values: Array) -> float:
    """Half the distance between the largest and the smallest value."""
    return 0.5 * (crest(values)[0] + crest(-values)[0])
