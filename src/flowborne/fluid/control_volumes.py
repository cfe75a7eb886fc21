"""Control volumes of the faces: one mass for everything that a face's velocity stands for.

The control volume of a face reaches from the middle of one of its cells to that of the other,

    V_f = (V_L + V_R) / 2

so it obeys the same law as the cells, with the means of their fluxes through its sides (Verstappen
and Veldman 2003). A face that is wholly closed is pushed by no pressure: what is left of its
control volume, a small one, is merged with others, its targets: what lies on either side of a thin
body stays there. So is the part of a control volume that is too large for the opening of its face.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.ghosts import edge
from flowborne.fluid.grid import Array, Faces, Grid
from flowborne.kernels.arrays import Integers, Marks
from flowborne.kernels.control_volumes import (
    find_parts,
    find_small,
    find_targets,
    merge_small,
    share_velocity,
)
from flowborne.kernels.faces import face_means

WHOLE = 0.99
"""Control volumes of this part of the largest one count as uncut."""

NARROW = 3.0
"""Control volume over open part x cell beyond which the rest of it is a small one:
pressure on a narrow opening would have to move all of it."""

NOTHING = 1e-9
"""Part of a cell below which a control volume holds nothing."""


@dataclass(frozen=True)
class ControlVolumes:
    """The control volumes of one geometry.

    cells   (nx, ny, nz) open volume of each cell, m^3
    volume  Faces, V_f, m^3; along a periodic axis the last is the first one
    merged  Faces, the same with that of the small ones at their targets, m^3
    small   (n,) of each axis, flat indices
    whole   (n,) of each axis, whether all of a small one goes with its targets
    targets (n, 2) of each axis; a small one without a target is its own
    shares  (n, 2) of each axis, parts of a small one that go with its targets
    """

    cells: Array
    volume: Faces
    merged: Faces
    small: tuple[Integers, Integers, Integers]
    whole: tuple[Marks, Marks, Marks]
    targets: tuple[Integers, Integers, Integers]
    shares: Faces

    def follow(self, velocity: Faces, grid: Grid) -> None:
        """Give small ones with nothing of their own the velocity of their targets, in place."""
        for axis in grid.axes:
            share_velocity(velocity[axis], *self.closed(axis))

    def closed(self, axis: int) -> tuple[Integers, Integers, Array]:
        """Small ones with nothing of their own, their targets and shares."""
        whole = self.whole[axis] == 1
        return self.small[axis][whole], self.targets[axis][whole], self.shares[axis][whole]

    def mean_velocity(self, velocity: Array, axis: int) -> Array:
        """That of each control volume across `axis`, small ones with their targets."""
        mean = velocity.copy()
        share_velocity(mean, self.small[axis], self.targets[axis], self.shares[axis])
        return mean


def means(cells: Array, axis: int, periodic: bool) -> Array:
    """Mean of both cells of each face across `axis`; 0 beyond the sides of the domain."""
    out = np.empty([n + int(a == axis) for a, n in enumerate(cells.shape)])
    face_means(out, np.ascontiguousarray(cells), axis, periodic)
    return out


def wrapping(component: int, grid: Grid, boundaries: Boundaries) -> Integers:
    """(3,) number of distinct faces across `component` along each periodic axis, else 0."""
    counts = np.array(grid.shape, np.int64)
    return counts * np.array(boundaries.periodic(), np.int64)


def control_volumes(
    cells: Array, opened: Faces, grid: Grid, boundaries: Boundaries
) -> ControlVolumes:
    """Control volumes of cells with these open volumes (m^3) and open parts of faces."""
    volumes, merged, small, whole, targets, shares = [], [], [], [], [], []
    periodic = boundaries.periodic()
    for axis in range(3):
        volume = means(cells, axis, periodic[axis])
        volumes.append(volume)
        total, own, part = volume.copy(), np.zeros(0, np.int64), np.zeros(0)
        target, share = np.zeros((0, 2), np.int64), np.zeros((0, 2))
        if axis in grid.axes:
            wraps, driven = wrapping(axis, grid, boundaries), np.empty(volume.shape, np.uint8)
            narrow, nothing = NARROW * grid.cell_volume, NOTHING * grid.cell_volume
            told, ring = boundaries.prescribed(axis), periodic[axis]
            own, part = find_small(driven, opened[axis], volume, axis, told, ring, narrow, nothing)
            target, share = find_targets(own, driven, volume, cells, axis, wraps)
            share *= part[:, None]
            kept = share.any(axis=1) | (part == 1.0)
            own, part, target, share = own[kept], part[kept], target[kept], share[kept]
            merge_small(total, own, target, share)
            if periodic[axis]:
                total[edge(axis, -1)] = total[edge(axis, 0)]
        merged.append(total)
        small.append(own)
        whole.append((part == 1.0).astype(np.uint8))
        targets.append(target)
        shares.append(share)
    return ControlVolumes(
        cells,
        (volumes[0], volumes[1], volumes[2]),
        (merged[0], merged[1], merged[2]),
        (small[0], small[1], small[2]),
        (whole[0], whole[1], whole[2]),
        (targets[0], targets[1], targets[2]),
        (shares[0], shares[1], shares[2]),
    )


def parts(before: Array, after: Array, component: int, grid: Grid, sides: Boundaries) -> Integers:
    """Flat indices of the control volumes that are cut at one of two times."""
    whole = WHOLE * max(float(before.max()), float(after.max()))
    wraps = wrapping(component, grid, sides)
    return np.asarray(find_parts(before, after, whole, component, wraps))
