"""Friction at a corner as it is derived: the least of a sum of squares."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array
from flowborne.kernels.corner_friction import AROUND, BEHIND, BESIDE, BEYOND, NARROW, NEXT

Known = tuple[float, float, float]


def removed_reference(
    narrow: float, beyond: float, volume: float, b: float, stays: bool, links: Known,
    walls: tuple[float, float],
) -> Array:  # fmt: skip
    """(5, 5) what the faces' own friction counts too much."""
    unit = np.eye(AROUND)
    lost = 0.5 * b if stays else 0.5 * b + b * (1.0 - 0.5 * b)
    rows = [
        (1.0 / volume, beyond * unit[BEYOND] - narrow * unit[NARROW]),
        (0.5 * (1.0 - b) * links[0], unit[BESIDE] - unit[NARROW]),
        (0.5 * (1.0 - b) * walls[0], unit[NARROW]),
        (lost * links[1], unit[NEXT] - unit[BEYOND]),
        (lost * links[2], unit[BEYOND] - unit[BEHIND]),
        (lost * walls[1], unit[BEYOND]),
    ]
    return sum((w * np.outer(row, row) for w, row in rows), np.zeros((AROUND, AROUND)))


def added_reference(
    narrow: float, beyond: float, volume: float, b: float, h: float, stays: bool, around: Array
) -> float:
    """What is dissipated around the line, by least squares over its flux and the shear beyond.

    around  (5,) velocities
    """
    u = dict(enumerate(around))
    before = min(0.5 * b * (narrow + h), volume)
    beside = (1.0 - b) * u[BESIDE] + b * u[NEXT]
    squares: list[tuple[float, float, float, float]] = [  # weight, constant, of Q, of d
        (1.0 / before, -narrow * u[NARROW], 1.0, 0.0),
        (1.0 / (1.0 + h), -beside, 1.0 / h, 0.0),
        (b / h, 0.0, 1.0 / h, 0.0),
    ]
    if stays:
        squares += [
            ((1.0 - b) / h, 0.0, 1.0 / h, 0.0),
            (1.0 / (volume - before), beyond * u[BEYOND], -1.0, 0.0),
        ]
    else:
        low, width = 1.0 - h, b * (1.0 - 0.5 * b)
        squares += [
            (1.0 - b, 0.0, 1.0 / h, 0.0),
            (1.0 / (h * (1.0 - b)), h * u[BEYOND], -1.0, h * low),
            (1.0 / (volume - before - h * (1.0 - b)), low * u[BEYOND], 0.0, -low * h),
            (2.0 * width / (1.0 + h), u[NEXT] - u[BEYOND], 0.0, -low),
            (2.0 * width, 0.0, 0.0, 1.0),
            (2.0 * width / (1.0 + low), u[BEYOND] - u[BEHIND], 0.0, -h),
            (h * low / b, 0.25 * (u[BEHIND] - u[NEXT]), 0.0, 1.0),
        ]
    weight, constant, *unknown = np.array(squares).T
    root = np.sqrt(weight)
    matrix = (root * np.array(unknown)).T
    best = np.linalg.lstsq(matrix, -root * constant, rcond=None)[0]
    return float(((matrix @ best + root * constant) ** 2).sum())
