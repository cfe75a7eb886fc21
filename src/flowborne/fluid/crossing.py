"""What crosses the sides of the domain with one component of velocity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.control_volumes import means
from flowborne.fluid.ghosts import edge
from flowborne.fluid.grid import Array, Faces, Grid
from flowborne.fluid.sides.side import Boundary, Layers, Slices
from flowborne.kernels.arrays import Marks
from flowborne.kernels.flux import GHOSTS, UPSTREAM


@dataclass(frozen=True)
class Crossing:
    """What crosses one side of the domain.

    side       of the domain
    near, far  layers of a padded field inside and outside the side
    rate       volume per time that comes in with each control volume's part of the side, m^3/s
    upstream   where what is upstream is carried, elsewhere the mean of inside and outside
    share      of each control volume in the volume of the layer
    """

    side: Boundary
    near: Slices
    far: Slices
    rate: Array
    upstream: NDArray[np.bool_]
    share: Array

    def draw_in(self, padded: Array) -> None:
        """Let what comes in have the velocity that the side gives it, if any, in place."""
        inward = self.rate > 0.0
        if not inward.any():
            return
        near, far = padded[self.near], padded[self.far]
        given = self.side.entering(near, self.share)
        if given is not None:
            np.copyto(far, np.where(self.upstream, given, 2.0 * given - near), where=inward)

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
    for place, side in sides.around(grid):
        if side.joined:
            continue
        through = flux[place.axis][place.layer]
        rate = -through if place.upper else through
        if place.axis != component:
            rate = means(rate, component, periodic[component])[own]
        layer, layers = volume[own][place.layer], Layers(place, GHOSTS, tuple(inner))
        near, far = layers.inside(0), layers.outside(0)
        share = layer / max(float(layer.sum()), np.finfo(float).tiny)
        found.append(Crossing(side, near, far, rate, marks[near] == UPSTREAM, share))
    return tuple(found)
