"""Prescribed motions of a joint as functions of time (`solids.trajectories.Trajectory`)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import PchipInterpolator

from flowborne.kernels.arrays import Array, Integers
from flowborne.motion.formula import Formula

SPEED_SAMPLES = 200
"""Number of times in a run at which the speed of a motion is evaluated."""


@dataclass
class TrajectoryConstant:
    """start + rate * time.

    dofs      (1,) the dof
    start     rad or m at time 0
    rate      rad/s or m/s
    """

    dofs: Integers
    start: float
    rate: float = 0.0

    def position(self, time: float) -> Array:
        """(1,) rad or m."""
        return np.array([self.start + self.rate * time])

    def velocity(self, time: float) -> Array:
        """(1,) rad/s or m/s."""
        return np.array([self.rate])


@dataclass
class TrajectorySinusoid:
    """mean + amplitude * sin(2 pi time / period + phase).

    dofs             (1,) the dof
    amplitude, mean  rad or m
    period           s
    phase            rad
    """

    dofs: Integers
    amplitude: float
    period: float
    mean: float = 0.0
    phase: float = 0.0

    def position(self, time: float) -> Array:
        """(1,) rad or m."""
        return np.array([self.mean + self.amplitude * np.sin(self._angle(time))])

    def velocity(self, time: float) -> Array:
        """(1,) rad/s or m/s."""
        rate = 2.0 * np.pi / self.period
        return np.array([self.amplitude * rate * np.cos(self._angle(time))])

    def _angle(self, time: float) -> float:
        return 2.0 * np.pi * time / self.period + self.phase


@dataclass(frozen=True)
class Curve:
    """Monotone C1 curve through keyframes; constant before the first and after the last.

    Between two keyframes it stays within their values. It starts and ends with slope 0, so that the
    velocity is continuous for all time.

    times   (k,) s, increasing, k >= 2
    values  (k,)
    source  Fritsch and Butland 1984 (SciPy's PCHIP), on a table with the first and last value
            repeated, which makes the end slopes 0
    """

    times: tuple[float, ...]
    values: tuple[float, ...]
    _curve: PchipInterpolator = field(init=False, repr=False, compare=False)
    _slope: PchipInterpolator = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        times, values = self.times, self.values
        before, after = times[0] - (times[1] - times[0]), times[-1] + (times[-1] - times[-2])
        with np.errstate(over="ignore"):  # 1 / slope may overflow: the result is then 0
            curve = PchipInterpolator((before, *times, after), (values[0], *values, values[-1]))
        object.__setattr__(self, "_curve", curve)
        object.__setattr__(self, "_slope", curve.derivative())

    def value(self, time: float) -> float:
        """Value at `time` (s), exact at keyframes."""
        if time >= self.times[-1]:
            return self.values[-1]
        return float(self._curve(max(time, self.times[0])))

    def slope(self, time: float) -> float:
        """Its derivative, 1/s."""
        inside = self.times[0] < time < self.times[-1]
        return float(self._slope(time)) if inside else 0.0


@dataclass
class TrajectoryKeyframes:
    """Smooth curve through keyframes; see `Curve`.

    dofs   (1,) the dof
    curve  rad or m over s
    """

    dofs: Integers
    curve: Curve

    def position(self, time: float) -> Array:
        """(1,) rad or m."""
        return np.array([self.curve.value(time)])

    def velocity(self, time: float) -> Array:
        """(1,) rad/s or m/s."""
        return np.array([self.curve.slope(time)])


@dataclass
class TrajectoryFormula:
    """unit * formula of time.

    dofs     (1,) the dof
    formula  degrees or m
    unit     rad of a degree, or 1
    """

    dofs: Integers
    formula: Formula
    unit: float = 1.0

    def position(self, time: float) -> Array:
        """(1,) rad or m."""
        return np.array([self.unit * self.formula.at(time).value])

    def velocity(self, time: float) -> Array:
        """(1,) rad/s or m/s."""
        return np.array([self.unit * self.formula.at(time).slope])
