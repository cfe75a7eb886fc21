"""Cells that a thin body passes over in a step: they hold fluid before it at first, at last behind.

On the mean of both ends such a cell joins the two sides of the body, and fluid would flow through.
So it is set aside while the leak-proof field is solved for: what it held goes to the cell before
the body, and what it holds at last comes from that behind.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne.coupling.fractions import Geometry
from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.control_volumes import NONE
from flowborne.fluid.grid import Array, Faces, Grid
from flowborne.kernels.arrays import Integers
from flowborne.kernels.control_volumes import neighbour
from flowborne.kernels.cut_dye import face_of

LEAST = 1e-3
"""Part of a face by which a body closes one side of a cell more than the other, if it has one."""

TURNED = -0.5
"""Cosine between the ways into the body at both ends below which it has passed over."""


@dataclass(frozen=True)
class Swept:
    """The cells that a body passes over.

    cells           (n,) flat indices
    held, holds     (n,) volumes at the start and at the end of the step, m^3
    ahead, behind   (n,) cells that take the one and give the other
    leaves, enters  (n,) through which face: 2 axis for the lower, 2 axis + 1 for the upper one
    """

    cells: Integers
    held: Array
    holds: Array
    ahead: Integers
    behind: Integers
    leaves: Integers
    enters: Integers

    def set_aside(
        self, flux: Faces, weights: Faces, before: Array, after: Array
    ) -> tuple[Array, Array]:
        """Let nothing through the faces of these cells, in place, and give the volumes at both ends
        of the step with theirs at the cells ahead and behind."""
        if self.cells.size == 0:
            return before, after
        shape = np.array(before.shape)
        for cell in self.cells:
            for way in range(6):
                face = face_of(shape, way // 2, cell, way % 2)
                for field in (flux, weights):
                    field[way // 2].reshape(-1)[face] = 0.0
        start, end = before.copy(), after.copy()
        np.add.at(start.reshape(-1), self.ahead, self.held)
        np.add.at(end.reshape(-1), self.behind, self.holds)
        start.reshape(-1)[self.cells] = end.reshape(-1)[self.cells] = 0.0
        return start, end

    def put_back(self, flux: Faces, volumes: Array, wanted: Array, dt: float) -> None:
        """Add what flows to and from these cells to the fluxes, m^3/s, and give them their part of
        the volumes that are reached, in place. A pocket beside them may not reach what it should.

        wanted  volumes that `set_aside` gave for the end of the step
        """
        if self.cells.size == 0:
            return
        shape = np.array(volumes.shape)
        reached, asked = (field.reshape(-1)[self.behind] for field in (volumes, wanted))
        holds = self.holds * np.divide(reached, asked, out=np.zeros(asked.size), where=asked > 0.0)
        for volume, ways, sign in ((self.held, self.leaves, 1.0), (holds, self.enters, -1.0)):
            for cell, part, way in zip(self.cells, volume, ways, strict=True):
                face = face_of(shape, way // 2, cell, way % 2)
                flux[way // 2].reshape(-1)[face] += sign * (2 * (way % 2) - 1) * part / dt
        np.subtract.at(volumes.reshape(-1), self.behind, holds)
        volumes.reshape(-1)[self.cells] += holds


NOTHING_SWEPT = Swept(NONE, np.zeros(0), np.zeros(0), NONE, NONE, NONE, NONE)


def swept_cells(
    before: Geometry, after: Geometry, cells: Array, grid: Grid, sides: Boundaries
) -> Swept:
    """The cells that are on the other side of a body at the end of a step.

    cells  (nx, ny, nz) volumes at the start, m^3
    """
    if before is after:  # bodies that stand still
        return NOTHING_SWEPT
    (keys, into), (later, into_later) = (ways_in(cut, grid, sides) for cut in (before, after))
    _, first, second = np.intersect1d(keys, later, assume_unique=True, return_indices=True)
    one, two = into[first], into_later[second]
    sizes = np.linalg.norm(one, axis=1), np.linalg.norm(two, axis=1)
    passed = (one * two).sum(axis=1) < TURNED * sizes[0] * sizes[1]
    passed &= np.minimum(*sizes) > LEAST
    if not passed.any():
        return NOTHING_SWEPT
    found, place = np.unique(keys[first][passed] % cells.size, return_index=True)
    leaves, ahead = way_out(found, one[passed][place], before.open, grid, sides)
    enters, behind = way_out(found, two[passed][place], after.open, grid, sides)
    kept = np.ones(found.size, bool)
    for beside in (ahead, behind):
        kept &= (beside >= 0) & ~np.isin(beside, found)
    found = found[kept]
    held, holds = cells.reshape(-1)[found], after.volume.reshape(-1)[found]
    return Swept(found, held, holds, ahead[kept], behind[kept], leaves[kept], enters[kept])


def ways_in(cut: Geometry, grid: Grid, sides: Boundaries) -> tuple[Integers, Array]:
    """Cells that bodies close in part, as cell + body x number of cells, ascending; and (n, 3) how
    much more of their faces on one side than on the other, a vector into the body. It has no part
    along an axis across a side of the domain that the cell lies at."""
    count = int(np.prod(grid.shape))
    keys, row = np.unique(cut.cells + cut.owner * count, return_inverse=True)
    into = np.zeros((keys.size, 3))
    np.add.at(into, row, cut.area / grid.face_area)
    at = np.unravel_index(keys % count, grid.shape)
    for axis in grid.axes:
        if not sides.periodic()[axis]:
            into[(at[axis] == 0) | (at[axis] == grid.shape[axis] - 1), axis] = 0.0
    return keys, into


def way_out(
    cells: Integers, into: Array, opened: Faces, grid: Grid, sides: Boundaries
) -> tuple[Integers, Integers]:
    """(n,) the face of each cell that leads away from the body, and the cell beyond; -1 where that
    face is closed or there is none."""
    shape = np.array(grid.shape)
    wraps = shape * np.array(sides.periodic())
    axes = np.abs(into).argmax(axis=1) if cells.size else np.zeros(0, np.int64)
    ways = 2 * axes + (into[np.arange(cells.size), axes] < 0.0)
    beyond = np.full(cells.size, -1)
    for n, (cell, way) in enumerate(zip(cells, ways, strict=True)):
        if opened[way // 2].reshape(-1)[face_of(shape, way // 2, cell, way % 2)] > 0.0:
            beyond[n] = neighbour(shape, wraps, cell, way)
    return ways, beyond
