"""Arrows, the forces on the bodies as arrows, and marks that are fixed in the world."""

from __future__ import annotations

from itertools import combinations, product

import numpy as np

from flowborne.kernels.arrays import Array
from flowborne.view.run import Run, State

HEAD_LENGTH = 3.6
HEAD_WIDTH = 3.0
"""Size of an arrow's head, in widths of its shaft."""

LARGE_FORCE_LENGTH = 0.2
"""Length of the arrow of a large force, in smaller sides of the view."""

LARGE_FORCE_PERCENTILE = 90.0
"""Percentile over the frames of the largest force that defines a large force."""

MAX_FORCE_LENGTH = 1.6
"""Maximum length of an arrow, in those of a large force: cuts the jolt of a sudden start."""

SHAFT_WIDTH = 5.0
"""Width of the shaft of a force's arrow, pixels."""

MIN_FORCE_LENGTH = 3.0
"""Length below which arrows are left out, pixels."""

ROUNDING_SHIFT = 1e-12
"""A force is rounding if it shifts a cube of fluid as large as the view by less than this share of
its side during the run."""

CROSS_SPACING = 0.22
"""Maximum distance between crosses, in smaller sides of the view; a round number of metres."""

CROSS_ARM = 0.06
"""Half length of a cross, in distances between them."""

MIN_CAMERA_PATH = 0.06
"""Extent of the camera's path above which there are marks, in smaller sides of the view."""


def flat_arrows(tails: Array, vectors: Array, width: float) -> Array:
    """(..., 7, 2) corners of arrows from `tails` (..., 2) along `vectors` (..., 2).

    The head of an arrow shorter than its head is scaled down. The tip is corner 3.

    width   of the shafts
    raises  ValueError if a vector is 0
    """
    length = np.hypot(vectors[..., :1], vectors[..., 1:])
    if not (length > 0.0).all():
        raise ValueError("an arrow of no length has no direction")
    along = vectors / length
    across = np.stack([-along[..., 1], along[..., 0]], axis=-1)
    shaft = np.minimum(width, length / HEAD_LENGTH)
    neck, half, wing = length - HEAD_LENGTH * shaft, 0.5 * shaft, 0.5 * HEAD_WIDTH * shaft
    zero = np.zeros_like(shaft)
    outline = [
        (zero, half), (neck, half), (neck, wing), (length, zero),
        (neck, -wing), (neck, -half), (zero, -half),
    ]  # fmt: skip
    return np.stack([tails + (a * along + b * across) for a, b in outline], axis=-2)


def round_number(value: float) -> float:
    """Largest of 1, 2 and 5 times a power of ten that is at most `value` > 0."""
    power = 10.0 ** np.floor(np.log10(value))
    step = max(n for n in (1.0, 2.0, 5.0) if n * power <= value * (1.0 + 1e-9))
    return float(step * power)


class Forces:
    """The forces of fluid and winds on the bodies of a run, as arrows of one scale.

    reach  m, length of the arrow of a large force
    large  N (N/m in a slab), size of a large force in the film; 0 if there is none above rounding
    unit   of `large`
    most   number of bodies, the largest number of arrows
    """

    def __init__(self, run: Run, side: float) -> None:
        """`side`: smaller side of the view, m."""
        self._axes = 2 if run.is_slab else 3
        carrying = () if run.flesh is None else run.flesh.bodies
        drawn = sorted({*carrying, *(geom.body for geom in run.geoms)})
        # the world is among them only if it is the only one
        self._bodies = [body for body in drawn if body > 0] or drawn
        self.most = len(self._bodies)
        self.reach = LARGE_FORCE_LENGTH * side
        self.large = 0.0
        if self._bodies:
            forces = run.every("fluid_force")[:, self._bodies, : self._axes]
            sizes = np.linalg.norm(forces, axis=-1).max(axis=1)
            finite = sizes[np.isfinite(sizes) & (sizes > 0.0)]
            large = float(np.percentile(finite, LARGE_FORCE_PERCENTILE)) if finite.size else 0.0
            self.large = large if large > _rounding(run, side) else 0.0
        self.unit = "N/m" if run.is_slab else "N"

    def arrows(self, state: State, pixel: float) -> list[tuple[int, Array, Array]]:
        """(body, tail, vector) of the forces that are large enough for an arrow.

        Tails and vectors are (2,) in a slab and (3,) in space, m.

        pixel  size of a pixel, m
        """
        arrows = []
        for body in self._bodies if self.large > 0.0 else ():
            force = state["fluid_force"][body, : self._axes].astype(float)
            vector = self.reach / self.large * force
            length = float(np.linalg.norm(vector))
            tail = state["fluid_centre"][body, : self._axes].astype(float)
            if not MIN_FORCE_LENGTH * pixel <= length < np.inf or not np.isfinite(tail).all():
                continue
            arrows.append((body, tail, min(1.0, MAX_FORCE_LENGTH * self.reach / length) * vector))
        return arrows


def _rounding(run: Run, side: float) -> float:
    """Force on bodies in a fluid at rest that comes from rounding, N (N/m in a slab).

    See ROUNDING_SHIFT; 0 without fluid. side: smaller side of the view, m.
    """
    duration = (len(run) - 1) / run.frames_per_second
    mass = run.density * side ** (2 if run.is_slab else 3)
    return 2.0 * ROUNDING_SHIFT * mass * side / duration**2 if duration > 0.0 else 0.0


def camera_moves(path: Array, side: float) -> bool:
    """Whether a camera that looks at `path` (frames, n) m moves noticeably; it shows `side` m."""
    return bool(np.ptp(path, axis=0).max() > MIN_CAMERA_PATH * side)


def crosses(low: Array, high: Array, side: float) -> Array:
    """(n, 2, 2) m, strokes of upright crosses between two corners (2,) of a plane.

    side  m, smaller side of the view
    """
    spacing = round_number(CROSS_SPACING * side)
    ticks = (
        spacing * np.arange(np.ceil(a / spacing), np.floor(b / spacing) + 1.0)
        for a, b in zip(low, high, strict=True)
    )
    centres = np.stack([axis.ravel() for axis in np.meshgrid(*ticks)], axis=1)
    arms = CROSS_ARM * spacing * np.array([[[-1.0, 0.0], [1.0, 0.0]], [[0.0, -1.0], [0.0, 1.0]]])
    return np.asarray((centres[:, None, None] + arms).reshape(-1, 2, 2))


def motes(count: int, around: Array, reach: float) -> Array:
    """(count, 3) m, random points within `reach` m of `around` (3,) along each axis.

    They are fixed in the world: if `around` moves a little, only points that leave on one side are
    replaced by points on the other side.
    """
    points = 2.0 * reach * np.random.default_rng(1).random((count, 3))
    offset = points - around
    return np.asarray(around + offset - 2.0 * reach * np.round(offset / (2.0 * reach)))


def box_edges(low: Array, high: Array) -> Array:
    """(12, 2, 3) ends of the edges of a box between two corners (3,)."""
    corners = np.array(list(product(*zip(low, high, strict=True))))
    pairs = combinations(corners, 2)
    return np.array([(a, b) for a, b in pairs if np.count_nonzero(a != b) == 1])
