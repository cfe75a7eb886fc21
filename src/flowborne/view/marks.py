"""Marks that stand still in the world: where a camera goes along, they show that it does."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flowborne.view.arrows import round_number

Array = NDArray[np.float64]

PITCH = 0.22
"""Largest distance between crosses, in smaller sides of what is seen; it is a round number of
metres."""

ARM = 0.06
"""Half length of a cross, in distances between them."""

MOVED = 0.06
"""Way of the camera from which on there are marks, in smaller sides of what is seen."""


def goes_along(path: Array, side: float) -> bool:
    """Whether a camera that looks at `path` (frames, n) m moves, and sees `side` m."""
    return bool(np.ptp(path, axis=0).max() > MOVED * side)


def crosses(low: Array, high: Array, side: float) -> Array:
    """(n, 2, 2) m, the strokes of upright crosses between two corners (2,) of a plane.

    side  m, smaller side of what is seen of it
    """
    pitch = round_number(PITCH * side)
    ticks = (
        pitch * np.arange(np.ceil(a / pitch), np.floor(b / pitch) + 1.0)
        for a, b in zip(low, high, strict=True)
    )
    middles = np.stack([axis.ravel() for axis in np.meshgrid(*ticks)], axis=1)
    arms = ARM * pitch * np.array([[[-1.0, 0.0], [1.0, 0.0]], [[0.0, -1.0], [0.0, 1.0]]])
    return np.asarray((middles[:, None, None] + arms).reshape(-1, 2, 2))


def motes(count: int, around: Array, reach: float) -> Array:
    """(count, 3) m, points strewn through space, those that are within `reach` m of `around` (3,)
    along each axis.

    They stand still: around another place nearby they are the same ones, but for those that are
    new at one side and gone at the other.
    """
    strewn = 2.0 * reach * np.random.default_rng(1).random((count, 3))
    away = strewn - around
    return np.asarray(around + away - 2.0 * reach * np.round(away / (2.0 * reach)))
