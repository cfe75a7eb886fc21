"""Fits of measured numbers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def straight_line(x: Array, y: Array) -> tuple[float, float, float]:
    """(slope, value at 0, largest relative deviation of y) of the line fitted by least squares.

    raises  ValueError if there are fewer than two different x
    """
    if np.unique(x).size < 2:
        raise ValueError(f"a line needs two different x, and x is {np.asarray(x).tolist()}")
    slope, start = np.polyfit(x, y, 1)
    line = slope * np.asarray(x, float) + start
    return float(slope), float(start), float(np.max(np.abs(np.asarray(y) - line) / np.abs(line)))
