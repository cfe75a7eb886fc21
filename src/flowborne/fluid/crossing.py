"""What crosses the sides of the domain with one component of velocity.

What leaves through an open side has its own velocity; what comes in there has the mean velocity of
the fluid along the whole side, so that a uniform flow stays as it is and, seen from a frame that
moves with the mean, no energy comes in. With its own velocity, a jet that once comes in would go on
for ever, and low pressure behind the side would draw it in ever faster (Bruneau and Fabrie 1994).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.control_volumes import means
from flowborne.fluid.ghosts import edge
from flowborne.fluid.grid import Array, Faces, Grid
from flowborne.kernels.arrays import Marks
from flowborne.kernels.flux import GHOSTS, UPSTREAM

Slices = tuple[slice, ...]


@dataclass(frozen=True)
class Crossing:
    """What crosses one side of the domain.

    near, far  layers of a padded field inside and outside the side
    rate       volume per time that comes in with each control volume's part of the side, m^3/s
    upstream   where what is upstream is carried, elsewhere the mean of inside and outside
    share      of each control volume in the volume of the layer; None of a side that is not open
    """

    near: Slices
    far: Slices
    rate: Array
    upstream: NDArray[np.bool_]
    share: Array | None

    def draw_in(self, padded: Array) -> None:
        """Let what comes in through an open side have the mean velocity along it, in place."""
        inward = self.rate > 0.0
        if self.share is None or not inward.any():
            return
        near, far = padded[self.near], padded[self.far]
        mean = float(np.vdot(self.share, near))
        np.copyto(far, np.where(self.upstream, mean, 2.0 * mean - near), where=inward)

    def came_in(self, padded: Array) -> float:
        """Volume times velocity that comes in per time, m^4/s^2."""
        near, far = padded[self.near], padded[self.far]
        upstream = np.where(self.rate > 0.0, far, near)
        return float(np.vdot(self.rate, np.where(self.upstream, upstream, 0.5 * (near + far))))


def crossings(
    flux: Faces, volume: Array, marks: Marks, component: int, grid: Grid, sides: Boundaries
) -> tuple[Crossing, ...]:
    """What crosses the sides of the domain with a component; none of axes that are periodic.

    flux    Faces, volume per time through each face, m^3/s
    volume  of the component's control volumes, m^3
    marks   of them, padded, see `marks_of`
    """
    periodic, found = sides.periodic(), []
    inner = [slice(GHOSTS, -GHOSTS) if a in grid.axes else slice(None) for a in range(3)]
    own = edge(component, slice(None))
    if periodic[component]:  # the last faces are the first ones
        inner[component], own = slice(GHOSTS, -GHOSTS - 1), edge(component, slice(-1))
    for axis in grid.axes:
        for end, side in enumerate(sides.pair(axis)):
            if periodic[axis]:
                continue
            last = edge(axis, slice(-1, None) if end else slice(1))
            rate = -flux[axis][last] if end else flux[axis][last]
            if axis != component:
                rate = means(rate, component, periodic[component])[own]
            layer = volume[own][last]
            near, far = list(inner), list(inner)
            near[axis] = slice(-3, -2) if end else slice(GHOSTS, GHOSTS + 1)
            far[axis] = slice(-2, -1) if end else slice(1, 2)
            upstream = marks[tuple(near)] == UPSTREAM
            share = layer / max(float(layer.sum()), np.finfo(float).tiny)
            drawn = share if side.kind == "open" else None
            found.append(Crossing(tuple(near), tuple(far), rate, upstream, drawn))
    return tuple(found)
