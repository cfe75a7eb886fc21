"""Arrows, the forces on the bodies as arrows, and marks that are fixed in the world."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flowborne.view.run import Run, State

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


LONGEST_FORCE = 0.2
"""Length of the arrow of a large force, as a share of the smaller side of what is seen."""

LARGE_FORCE = 90.0
"""Percentile over the frames of the largest force that counts as a large one."""

CUT_FORCE = 1.6
"""Longest arrow in lengths of that of a large force: where the jolt of a sudden start ends."""

SHAFT = 5.0
"""Width of the shaft of a force's arrow, pixels."""

SHORTEST = 3.0
"""Arrows shorter than this many pixels are left out."""


class Forces:
    """The arrows of a run.

    reach  m, length of the arrow of a large force
    large  N (N per unit depth in a slab), size of a large force of the film; 0 when there is none
    unit   of `large`
    """

    def __init__(self, run: Run, side: float) -> None:
        """`side` is the smaller side of what is seen, m."""
        self._axes = 2 if run.slab else 3
        self._bodies = _pushed(run)
        self.reach = LONGEST_FORCE * side
        self.large = self._large(run)
        self.unit = "N/m" if run.slab else "N"

    def arrows(self, state: State, pixel: float) -> list[tuple[int, Array, Array]]:
        """(body, tail, vector) of the forces that are worth an arrow.

        Tails and vectors are (2,) in a slab and (3,) in space, m.

        pixel  size of a pixel, m
        """
        arrows = []
        for body in self._bodies if self.large > 0.0 else ():
            force = state["fluid_force"][body, : self._axes].astype(float)
            vector = self.reach / self.large * force
            length = float(np.linalg.norm(vector))
            tail = state["fluid_centre"][body, : self._axes].astype(float)
            if not SHORTEST * pixel <= length < np.inf or not np.isfinite(tail).all():
                continue
            arrows.append((body, tail, min(1.0, CUT_FORCE * self.reach / length) * vector))
        return arrows

    def _large(self, run: Run) -> float:
        if not self._bodies:
            return 0.0
        forces = run.every("fluid_force")[:, list(self._bodies), : self._axes]
        sizes = np.linalg.norm(forces, axis=-1).max(axis=1)
        finite = sizes[np.isfinite(sizes) & (sizes > 0.0)]
        return float(np.percentile(finite, LARGE_FORCE)) if finite.size else 0.0


def _pushed(run: Run) -> tuple[int, ...]:
    """Bodies whose forces are shown: those that are drawn, the world's only when it is alone."""
    carrying = () if run.flesh is None else run.flesh.bodies
    drawn = sorted({*carrying, *(geom.body for geom in run.geoms)})
    return tuple(body for body in drawn if body > 0) or tuple(drawn)


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
