"""The forces of fluid and winds on the bodies, as arrows of one scale for all frames."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flowborne.view.run import Run, State

Array = NDArray[np.float64]

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
