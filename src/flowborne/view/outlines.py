"""Outlines of the cross-sections of bodies and flesh in a slab."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Integers
from flowborne.shapes.section import Section
from flowborne.view.run import Run, State

ARC = 72
"""Corners of the outline of a full circle."""


class Outlines:
    """Closed outlines of the rigid geometries of a run."""

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
        poses = zip(state["geom_position"], state["geom_rotation"], self._corners, strict=True)
        return [(position + corners @ rotation.T)[:, :2] for position, rotation, corners in poses]


def flesh_loops(run: Run, state: State) -> list[Array]:
    """Outlines (k, 2) of the flesh of a state, m; none if its vertices are not finite."""
    if run.flesh is None or not np.isfinite(state["flesh_vertices"]).all():
        return []
    return skin_loops(state["flesh_vertices"].astype(float), run.flesh.triangles)


def _loop(cut: Section) -> Array:
    """(k, 3) consecutive corners of a cross-section; of several loops the longest."""
    segments = cut.outline(ARC)
    if cut.family != "segments":
        return np.asarray(segments[:, 0])
    reach = np.ptp(segments.reshape(-1, 3), axis=0).max()
    keys = [tuple(key) for key in np.rint(segments[:, 0] / (1e-6 * reach)).astype(int).tolist()]
    ends = [tuple(key) for key in np.rint(segments[:, 1] / (1e-6 * reach)).astype(int).tolist()]
    next_of = {key: n for n, key in enumerate(keys)}
    longest: list[int] = []
    remaining = set(range(len(segments)))
    while remaining:
        loop = [remaining.pop()]
        while (n := next_of.get(ends[loop[-1]])) in remaining:
            remaining.remove(n)
            loop.append(n)
        longest = max(longest, loop, key=len)
    return np.asarray(segments[longest, 0])


def skin_loops(vertices: Array, triangles: Integers) -> list[Array]:
    """Closed outlines (k, 2) of the cut of a skin with the plane z = 0, m; flesh is on their left.

    A vertex in the plane counts as above it, so that every outline is closed.

    vertices   (n, 3) m
    triangles  (m, 3) vertices of each, outward; the surface is closed
    """
    above = vertices[:, 2] >= 0.0
    edges = triangles[:, [[0, 1], [1, 2], [2, 0]]]
    starts, ends = above[edges[..., 0]], above[edges[..., 1]]
    # each cut triangle has one edge of each kind; edges are (upper, lower) vertex
    falling, rising = edges[starts & ~ends], edges[~starts & ends][:, ::-1]
    high, low = vertices[falling[:, 0]], vertices[falling[:, 1]]
    points = low + (low[:, 2:] / (low[:, 2:] - high[:, 2:])) * (high - low)
    point_of = {tuple(edge): n for n, edge in enumerate(falling.tolist())}
    next_of = [point_of[tuple(edge)] for edge in rising.tolist()]
    loops, remaining = [], set(range(len(next_of)))
    while remaining:
        loop = [min(remaining)]
        while (n := next_of[loop[-1]]) != loop[0]:
            loop.append(n)
        remaining -= set(loop)
        loops.append(points[loop, :2])
    return loops
