"""Arrows as filled outlines, and round numbers for their legends."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

HEAD_LENGTH = 3.6
HEAD_WIDTH = 3.0
"""Of an arrow's head, in widths of its shaft."""


def arrow(tail: Array, vector: Array, width: float) -> Array:
    """(7, 2) corners of an arrow from `tail` (2,) along `vector` (2,) with a shaft `width` wide.

    An arrow shorter than its head is that head, smaller. The tip is corner 3.
    raises  ValueError when the vector has no length
    """
    length = float(np.hypot(*vector))
    if not length > 0.0:
        raise ValueError("an arrow of no length has no direction")
    along = np.asarray(vector, float) / length
    across = np.array([-along[1], along[0]])
    width = min(width, length / HEAD_LENGTH)
    neck = length - HEAD_LENGTH * width
    half, wing = 0.5 * width, 0.5 * HEAD_WIDTH * width
    outline = [
        (0.0, half), (neck, half), (neck, wing), (length, 0.0),
        (neck, -wing), (neck, -half), (0.0, -half),
    ]  # fmt: skip
    return np.asarray(tail, float) + np.array([a * along + b * across for a, b in outline])


def round_number(value: float) -> float:
    """Largest of 1, 2 and 5 times a power of ten that is not above `value` > 0."""
    power = 10.0 ** np.floor(np.log10(value))
    step = max(n for n in (1.0, 2.0, 5.0) if n * power <= value * (1.0 + 1e-9))
    return float(step * power)
