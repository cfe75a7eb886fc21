"""The band around moving bodies in which fluxes are corrected (see `leak_proof`)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.ghosts import edge, plane, planes
from flowborne.fluid.grid import Grid, extent, faces_of
from flowborne.fluid.projection import PressureGradient
from flowborne.kernels.arrays import Faces, Marks
from flowborne.kernels.projection import Volumes, fill_around
from flowborne.solvers.pressure import PressureSystem

Projection = tuple[PressureGradient, PressureSystem]
"""The gradient of a projection and its matrix."""

LAYERS = 3
"""Cells around those that have to be corrected: a body goes no farther than a cell in a step, and
the velocity of the last one did not know those that it has uncovered since."""

LARGEST = 0.5
"""Part of the grid beyond which a band saves less than it costs."""

EVEN = 8
"""Cells of a band along each axis are a multiple of this, on both ends alike: few shapes, of which
solves keep arrays, and three levels of the multigrid without an odd row."""


@dataclass(frozen=True)
class Band:
    """A box of cells in which fluxes are corrected.

    grid   its own
    cells  index of its cells in a field of the whole grid
    """

    grid: Grid
    cells: tuple[slice, slice, slice]

    def faces(self, axis: int) -> tuple[slice, ...]:
        """Index of its faces across an axis in a field of the whole grid."""
        return tuple(slice(c.start, c.stop + (n == axis)) for n, c in enumerate(self.cells))

    def own(self, field: Faces) -> Faces:
        """A copy of what a field has on its faces."""
        return faces_of([f[self.faces(axis)].copy() for axis, f in enumerate(field)])

    def inner(self, weights: Faces) -> Faces:
        """The same, 0 on its rim: what flows through that is kept."""
        own = self.own(weights)
        for axis in self.grid.axes:
            own[axis][edge(axis, 0)] = own[axis][edge(axis, -1)] = 0.0
        return own

    def fill_around(self, flux: Faces, volumes: Volumes, dt: float, whole: Grid) -> None:
        """Let fluxes fill the cells outside, in place, by what they pass on towards the band.

        volumes  see `kernels.projection.mark_unsettled`
        """
        start, rate, before, end = (plane(v, whole) for v in volumes)
        x, y, z = ((c.start, c.stop) for c in self.cells)
        box = ((0, 1), x, y) if whole.is_slab else (x, y, z)
        fill_around(planes(flux, whole), (start, rate, before, end), box, dt)


def band_around(cells: Marks, grid: Grid, sides: Boundaries) -> Band | None:
    """The band around cells that have to be corrected; None where it should be all of the grid.

    That is where it would be LARGEST, where it reaches a side (bodies may part the fluid between
    two of them, and each part displaces fluid far away), and where sides are periodic (bodies
    beside one and across it should move alike).
    """
    box, shape = [slice(0, n) for n in grid.shape], list(grid.shape)
    if any(sides.periodic()) or not cells.any():
        return None
    for axis in grid.axes:
        n, (first, stop) = grid.shape[axis], extent(cells, axis)
        first, stop = first - LAYERS, stop + LAYERS
        more = (first - stop) % EVEN
        size = stop - first + more
        if first < 0 or stop > n or size > n:
            return None
        first = min(max(first - more // 2, 0), n - size)
        box[axis], shape[axis] = slice(first, first + size), size
    if np.prod(shape) > LARGEST * cells.size:
        return None
    return Band(replace(grid, shape=(shape[0], shape[1], shape[2])), (box[0], box[1], box[2]))
