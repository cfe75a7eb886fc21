"""Inflow through a side: velocity profiles in space and time, and bands of dye."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from flowborne.kernels.arrays import Array
from flowborne.motion.formula import Formula
from flowborne.motion.tracks import Curve

Span = tuple[int, float, float]
"""Axis, and the two ends of the side along it in m."""


class Factor(Protocol):
    """The strength of an inflow or a mouth over time."""

    def at(self, time: float) -> float:
        """Factor of the full velocity at `time` (s)."""
        ...


@dataclass(frozen=True)
class FactorSteady:
    """Always the full velocity."""

    def at(self, time: float) -> float:
        """1."""
        return 1.0


@dataclass(frozen=True)
class FactorRamp:
    """Rises from 0 to 1 within `duration` s, with zero slope at both ends."""

    duration: float

    def at(self, time: float) -> float:
        """Half a cosine wave, then 1."""
        if time >= self.duration:
            return 1.0
        return 0.5 - 0.5 * math.cos(math.pi * max(time, 0.0) / self.duration)


@dataclass(frozen=True)
class FactorKeyframes:
    """Smooth curve through keyframes."""

    curve: Curve

    def at(self, time: float) -> float:
        """The curve at `time`."""
        return self.curve.value(time)


@dataclass(frozen=True)
class FactorPulse:
    """Half a sine wave for `duration` s of every `period` s, the first from `start` s on."""

    period: float
    duration: float
    start: float = 0.0

    def at(self, time: float) -> float:
        """Between 0 and 1."""
        since = math.fmod(time - self.start, self.period)
        if time < self.start or since >= self.duration:
            return 0.0
        return math.sin(math.pi * since / self.duration)


@dataclass(frozen=True)
class FactorFormula:
    """A formula in time."""

    formula: Formula

    def at(self, time: float) -> float:
        """Its value. Raises ArithmeticError where it is not finite."""
        return self.formula.at(time).value


@dataclass(frozen=True)
class InflowProfile:
    """Velocity on a side: uniform, or with a parabola along each of some spans of the side.

    A parabola is 0 at the ends of its span and leaves the mean velocity unchanged. Along one span
    it is plane Poiseuille flow with 1.5 times the mean in the middle; along two it is the product
    of two parabolas.

    velocity  m/s, mean over the side
    factor    of the velocity, over time
    """

    velocity: tuple[float, float, float]
    factor: Factor
    spans: tuple[Span, ...] = ()

    @property
    def steady(self) -> bool:
        """Whether it never changes."""
        return isinstance(self.factor, FactorSteady)

    def __call__(self, x: Array, y: Array, z: Array, time: float) -> tuple[Array, Array, Array]:
        """(u, v, w) in m/s at points in m and a time in s."""
        part = np.full(np.broadcast(x, y, z).shape, self.factor.at(time))
        for axis, low, high in self.spans:
            s = ((x, y, z)[axis] - low) / (high - low)
            part = part * (6.0 * s * (1.0 - s))
        u, v, w = (part * component for component in self.velocity)
        return u, v, w


@dataclass(frozen=True)
class Bands:
    """Bands of dye on a side.

    axis   along which the bands alternate
    ends   (from, to) of each band in m
    value  of the dye in a band; 0 outside
    times  (start, stop) in s
    """

    axis: int
    ends: tuple[tuple[float, float], ...]
    value: float
    times: tuple[float, float]


@dataclass(frozen=True)
class DyeBandsValue:
    """Value of a dye that enters through a side: the maximum over its bands."""

    groups: tuple[Bands, ...]

    def __call__(self, x: Array, y: Array, z: Array, time: float) -> Array:
        """Value at points in m and a time in s."""
        values = np.zeros(np.broadcast(x, y, z).shape)
        for group in self.groups:
            if not group.times[0] <= time < group.times[1]:
                continue
            s = (x, y, z)[group.axis]
            for low, high in group.ends:
                inside = (s >= low) & (s < high)
                values = np.maximum(values, np.where(inside, group.value, 0.0))
        return values


def even_bands(
    low: float, high: float, count: int, width: float
) -> tuple[tuple[float, float], ...]:
    """(from, to) of `count` bands of equal width, evenly spaced between `low` and `high` (m)."""
    pitch = (high - low) / count
    centres = (low + (index + 0.5) * pitch for index in range(count))
    return tuple((centre - 0.5 * width, centre + 0.5 * width) for centre in centres)
