"""The bodies of a slab as flat shapes: the outline of each geometry's cross-section."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flowborne.solids.slab import Section, section
from flowborne.view.run import Run, State

Array = NDArray[np.float64]

ARC = 72
"""Corners of a full circle in a drawn outline."""


class Outlines:
    """Closed outlines of the geometries of a run, which keep their shape as they move."""

    def __init__(self, run: Run) -> None:
        state = run.state(0)
        self._corners = [
            _loop(
                section(
                    geom.kind,
                    geom.size,
                    state["geom_rotation"][n].astype(float),
                    float(state["geom_position"][n, 2]),
                    geom.mesh,
                )
            )
            for n, geom in enumerate(run.geoms)
        ]

    def placed(self, state: State) -> list[Array]:
        """(k, 2) outline of each geometry in the x-y plane, m."""
        if not self._corners:
            return []
        centres, turns = state["geom_position"], state["geom_rotation"]
        return [
            (centre + corners @ turn.T)[:, :2]
            for corners, centre, turn in zip(self._corners, centres, turns, strict=True)
        ]


def _loop(cut: Section) -> Array:
    """(k, 3) corners of a cross-section one after the other; of several loops the longest."""
    segments = cut.outline(ARC)
    if cut.family != "segments":
        return np.asarray(segments[:, 0])
    reach = np.ptp(segments.reshape(-1, 3), axis=0).max()
    keys = [tuple(key) for key in np.rint(segments[:, 0] / (1e-6 * reach)).astype(int).tolist()]
    ends = [tuple(key) for key in np.rint(segments[:, 1] / (1e-6 * reach)).astype(int).tolist()]
    following = {key: n for n, key in enumerate(keys)}
    longest: list[int] = []
    left = set(range(len(segments)))
    while left:
        loop = [left.pop()]
        while (n := following.get(ends[loop[-1]])) in left:
            left.remove(n)
            loop.append(n)
        longest = max(longest, loop, key=len)
    return np.asarray(segments[longest, 0])
