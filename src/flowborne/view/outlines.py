"""The bodies and flesh of a slab as flat shapes: the outlines of their cross-sections."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flowborne.shapes.section import Section
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
                geom.shape.section(
                    state["geom_rotation"][n].astype(float), float(state["geom_position"][n, 2])
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


def flesh_loops(run: Run, state: State) -> list[Array]:
    """Outlines (k, 2) of the flesh of a state, m; none when its numbers are lost."""
    if run.flesh is None or not np.isfinite(state["flesh_vertices"]).all():
        return []
    return skin_loops(state["flesh_vertices"].astype(float), run.flesh.triangles)


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


def skin_loops(vertices: Array, triangles: NDArray[np.int64]) -> list[Array]:
    """Closed outlines (k, 2) of what a skin's plane z = 0 cuts, m; flesh is on their left.

    A vertex in the plane counts as just above it, so that every outline closes.

    vertices   (n, 3) m;  triangles  (m, 3) of them, outward, that close
    """
    above = vertices[:, 2] >= 0.0
    edges = triangles[:, [[0, 1], [1, 2], [2, 0]]]
    starts, ends = above[edges[..., 0]], above[edges[..., 1]]
    # each triangle that is cut has one edge of each kind, (upper, lower) vertex
    falling, rising = edges[starts & ~ends], edges[~starts & ends][:, ::-1]
    high, low = vertices[falling[:, 0]], vertices[falling[:, 1]]
    places = low + (low[:, 2:] / (low[:, 2:] - high[:, 2:])) * (high - low)
    place_of = {tuple(edge): n for n, edge in enumerate(falling.tolist())}
    following = [place_of[tuple(edge)] for edge in rising.tolist()]
    loops, left = [], set(range(len(following)))
    while left:
        loop = [min(left)]
        while (n := following[loop[-1]]) != loop[0]:
            loop.append(n)
        left -= set(loop)
        loops.append(places[loop, :2])
    return loops
