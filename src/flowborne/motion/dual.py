"""Numbers that carry their derivative, and the functions of a formula on them."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Dual:
    """value + slope e with e^2 = 0: a number and its derivative by time.

    At a kink (`absolute`, `least`, `most`) the slope is that on the side of later times.
    """

    value: float
    slope: float = 0.0

    def __neg__(self) -> Dual:
        return Dual(-self.value, -self.slope)

    def __pos__(self) -> Dual:
        return self

    def __add__(self, other: Dual) -> Dual:
        return Dual(self.value + other.value, self.slope + other.slope)

    def __sub__(self, other: Dual) -> Dual:
        return Dual(self.value - other.value, self.slope - other.slope)

    def __mul__(self, other: Dual) -> Dual:
        return Dual(self.value * other.value, self.slope * other.value + self.value * other.slope)

    def __truediv__(self, other: Dual) -> Dual:
        ratio = self.value / other.value
        return Dual(ratio, (self.slope - ratio * other.slope) / other.value)

    def __mod__(self, other: Dual) -> Dual:
        whole = math.floor(self.value / other.value)
        return Dual(self.value % other.value, self.slope - whole * other.slope)

    def __pow__(self, other: Dual) -> Dual:
        base, exponent = self.value, other.value
        power = math.pow(base, exponent)
        slope = 0.0
        if self.slope and exponent:
            slope += exponent * math.pow(base, exponent - 1.0) * self.slope
        if other.slope:
            slope += power * math.log(base) * other.slope
        return Dual(power, slope)


def sine(x: Dual) -> Dual:
    return Dual(math.sin(x.value), math.cos(x.value) * x.slope)


def cosine(x: Dual) -> Dual:
    return Dual(math.cos(x.value), -math.sin(x.value) * x.slope)


def tangent(x: Dual) -> Dual:
    value = math.tan(x.value)
    return Dual(value, (1.0 + value**2) * x.slope)


def exponential(x: Dual) -> Dual:
    value = math.exp(x.value)
    return Dual(value, value * x.slope)


def logarithm(x: Dual) -> Dual:
    return Dual(math.log(x.value), x.slope / x.value)


def square_root(x: Dual) -> Dual:
    value = math.sqrt(x.value)
    return Dual(value, 0.5 * x.slope / value if x.slope else 0.0)


def hyperbolic_tangent(x: Dual) -> Dual:
    value = math.tanh(x.value)
    return Dual(value, (1.0 - value**2) * x.slope)


def absolute(x: Dual) -> Dual:
    return most(x, -x)


def least(*given: Dual) -> Dual:
    return min(given, key=_forwards)


def most(*given: Dual) -> Dual:
    return max(given, key=_forwards)


def _forwards(x: Dual) -> tuple[float, float]:
    """Order in which numbers are a moment later."""
    return x.value, x.slope


def ramp(x: Dual, length: Dual = Dual(1.0)) -> Dual:
    """Smooth step 3 s^2 - 2 s^3 with s = x / length from 0 to 1."""
    s = least(most(x / length, Dual(0.0)), Dual(1.0))
    return s * s * (Dual(3.0) - Dual(2.0) * s)
