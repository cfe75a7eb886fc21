"""Bodies in a stream that shed vortices: coefficients and their figures over whole periods."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from flowborne import Array, StepReport, World
from flowborne.worlds import Field, velocity_at
from flowborne_validation.worlds import (
    Place,
    Uniform,
    Vector,
    force_on,
    mjcf,
    over_places,
    recorded,
)

BEFORE, AFTER = 40.0, 15.0
"""Times D/U before a flow that sheds vortices is evaluated: in the first world, where shedding has
to begin and in open water takes twice as long, and in one that starts from the flow of another."""

CFL = 1.0
"""Cells that the oncoming flow crosses in a step."""


@dataclass(frozen=True)
class Stream:
    """A flow past a cylinder, with the scales of its coefficients.

    diameter  m
    speed     U of the coefficients, m/s
    fastest   largest oncoming velocity, m/s
    """

    diameter: float
    speed: float
    fastest: float

    def coefficients(self, report: StepReport) -> tuple[float, float]:
        """Drag and lift coefficient, 2 F / (rho U^2 D)."""
        drag, lift = 2.0 * force_on(report)[:2] / (self.speed**2 * self.diameter)
        return float(drag), float(lift)

    @property
    def time(self) -> float:
        """D / U, s."""
        return self.diameter / self.speed


UNBOUNDED, STREAM = Stream(1.0, 1.0, 1.0), Uniform((1.0, 0.0, 0.0))
"""1 m/s past a body of D = 1 m in open water, and the oncoming velocity."""


@dataclass(frozen=True)
class Kicked:
    """A field with a gust across the wake of the cylinder at (x, y), so that shedding begins."""

    field: Field
    stream: Stream
    x: float
    y: float

    def __call__(self, x: Array, y: Array, z: Array) -> tuple[Array, Array, Array]:
        u, v, w = self.field(x, y, z)
        size = self.stream.diameter
        away = ((x - self.x) / size - 1.5) ** 2 + ((y - self.y) / size) ** 2
        return u, v + 0.5 * self.stream.speed * np.exp(-away), w


def cylinder(diameter: float, x: float, y: float) -> str:
    """MJCF of a fixed cylinder, body 1."""
    return mjcf(
        f'<body name="cylinder" pos="{x} {y} 0">'
        f'<geom type="cylinder" size="{0.5 * diameter} 1"/></body>'
    )


@dataclass(frozen=True)
class Oscillation:
    """A periodic signal (n,), such as the lift, in samples dt (s) apart."""

    dt: float
    signal: Array

    def rises(self) -> Array:
        """Times at which the signal rises through its mean, s."""
        away = self.signal - self.signal.mean()
        at = np.flatnonzero((away[:-1] <= 0.0) & (away[1:] > 0.0))
        return self.dt * (at + away[at] / (away[at] - away[at + 1]))

    def last(self, periods: int) -> tuple[slice, float]:
        """The samples of the last whole periods, and the length of one in s. Raises ArithmeticError
        when there are not so many."""
        rises = self.rises()
        if rises.size <= periods:
            raise ArithmeticError(f"the lift rises {rises.size} times, {periods + 1} are needed")
        start, stop = rises[-1 - periods], rises[-1]
        samples = slice(round(start / self.dt), round(stop / self.dt))
        return samples, float((stop - start) / periods)

    def unsteadiness(self, periods: int) -> str:
        """Amplitudes of the lift in the first and the last of some periods, as text."""
        samples, period = self.last(periods)
        count = round(period / self.dt)
        lift = self.signal[samples]
        one, other = (amplitude(part) for part in (lift[:count], lift[-count:]))
        return f"lift's amplitude {one:.4f} in the first period, {other:.4f} in the last"


def backflow(world: World, back: Vector, longest: float) -> float:
    """Length of the backflow along x from a body's back, m, at most `longest`; 0 where there is
    none one cell behind the back."""
    h = world.flow()[0].grid.spacing
    x = np.arange(h, longest, 0.05 * h)
    u = velocity_at(world, np.array(back) + x[:, None] * np.array(STREAM.velocity))[:, 0]
    i = int(np.argmax(u > 0.0))
    return float(x[i] - 0.05 * h * u[i] / (u[i] - u[i - 1])) if i else 0.0


def crest(values: Array) -> tuple[float, float]:
    """Largest value and its place in samples: vertex of the parabola through three samples."""
    at = int(np.argmax(values[1:-1])) + 1
    before, here, after = values[at - 1 : at + 2]
    bend = before - 2.0 * here + after
    shift = 0.5 * (before - after) / bend if bend < 0.0 else 0.0
    return float(here - 0.25 * (before - after) * shift), at + float(shift)


def amplitude(values: Array) -> float:
    """Half the distance between the largest and the smallest value."""
    return 0.5 * (crest(values)[0] + crest(-values)[0])


def watch(
    world: World,
    stream: Stream,
    before: float,
    strouhal: float,
    periods: int,
    drop: Callable[[World], float] = lambda world: 0.0,
) -> tuple[Oscillation, Array, Array]:
    """March, and record every step.

    before    times D/U until the flow is periodic
    strouhal  rough value of the expected frequency
    drop      a further figure of the flow
    returns   lift coefficient; (n,) drag coefficient; (n,) the further figure
    """
    fluid, _ = world.flow()
    dt = CFL * fluid.grid.spacing / stream.fastest
    duration = (before + (periods + 1.5) / strouhal) * stream.time
    drags, lifts, drops = recorded(
        world, dt, round(duration / dt), lambda report: (*stream.coefficients(report), drop(world))
    ).T
    return Oscillation(dt, lifts), drags, drops


def shed(
    build: Callable[[int, Place], World],
    strouhal: float,
    grids: Sequence[int],
    periods: int,
    once: Sequence[int] = (),
) -> tuple[list[Any], list[str]]:
    """Mean drag, amplitude of the lift and frequency of a cylinder at the origin in UNBOUNDED, as
    `over_places` has them, by the cells across D.

    strouhal  rough value of the expected frequency
    periods   that are evaluated
    """

    def measure(world: World, first: bool) -> tuple[Sequence[float], str]:
        before = 2.0 * BEFORE if first else AFTER
        seen, drags, _ = watch(world, UNBOUNDED, before, strouhal, periods)
        steps, period = seen.last(periods)
        lift = amplitude(seen.signal[steps])
        figures = float(drags[steps].mean()), lift, UNBOUNDED.time / period
        return figures, seen.unsteadiness(periods)

    return over_places(grids, build, Kicked(STREAM, UNBOUNDED, 0.0, 0.0), measure, once)
