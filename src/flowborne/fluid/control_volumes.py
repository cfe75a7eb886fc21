"""Control volumes of the faces, and the volumes that move with them.

The control volume of a face reaches from the middle of one of its cells to that of the other,

    V_f = (V_L + V_R) / 2

so it obeys the same law as the cells, with the means of their fluxes through its sides (Verstappen
and Veldman 2003). A difference of pressures accelerates a face as it should where the volume M_f
that moves with it is near a h^3, of its open part a. So control volumes give parts of theirs to
their neighbours, in pairs, and sums stay: a face that is wholly closed gives all to the opposite
faces of its cells, so that what lies on either side of a thin body stays there; and open ones even
out what they have beyond a h^3, by diffusion along one axis after the other.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.ghosts import edge, kernel_axes, plane, planes
from flowborne.fluid.grid import Array, Faces, Grid, faces_of
from flowborne.kernels.arrays import Integers, Marks
from flowborne.kernels.control_volumes import (
    Closed,
    Transfers,
    find_targets,
    listed_kinds,
    merge_small,
    share_velocity,
    sort_faces,
)
from flowborne.kernels.face_masses import even_out, openings, with_neighbours
from flowborne.kernels.faces import face_means

WHOLE = 0.99
"""Control volumes of this part of a cell count as uncut."""

NOTHING = 1e-9
"""Part of a cell below which a control volume holds nothing."""


SLACK = 1e-3
"""Part of a cell by which the volume of a face that is not cut may differ from a h^3: those of a
closed region are scaled alike (see `leak_proof`)."""

ROUNDS = 2
"""Times that volumes are evened out along all axes, and so as many neighbours as take part. The
velocity on cut faces of the potential flow past a circle is off by 0.050, 0.025, 0.019 of the
stream (rms) with 8, 16, 32 cells to its diameter; with one round by 0.046, 0.043, 0.040, with three
by 0.061, 0.030, 0.018, and by 0.115, 0.135, 0.121 where control volumes keep what they have."""

NONE = np.zeros(0, np.int64)
NONE_CLOSED = Closed(NONE, np.zeros((0, 2), np.int64), np.zeros((0, 2)))
NO_TRANSFERS = Transfers(NONE, NONE, np.zeros(0))


@dataclass(frozen=True)
class ControlVolumes:
    """The control volumes of one geometry.

    cells      (nx, ny, nz) open volume of each cell, m^3
    moving     Faces, M_f, what moves with each face, m^3; 0 at closed ones
    cut        of each axis, (n,) flat indices of those that are not whole
    closed     of each axis
    transfers  of each axis, from V_f to M_f
    periodic   which axes are
    """

    cells: Array
    moving: Faces
    cut: tuple[Integers, Integers, Integers]
    closed: tuple[Closed, Closed, Closed]
    transfers: tuple[Transfers, Transfers, Transfers]
    periodic: tuple[bool, bool, bool]

    @cached_property
    def volume(self) -> Faces:
        """Faces, V_f, m^3; along a periodic axis the last is the first one."""
        return faces_of([means(self.cells, axis, self.periodic[axis]) for axis in range(3)])

    def follow(self, velocity: Faces, grid: Grid) -> None:
        """Give closed faces the velocity of their targets, in place."""
        for axis in grid.axes:
            share_velocity(velocity[axis], *self.closed[axis])


def means(cells: Array, axis: int, periodic: bool) -> Array:
    """Mean of both cells of each face across `axis`; 0 beyond the sides of the domain."""
    out = np.empty([n + int(a == axis) for a, n in enumerate(cells.shape)])
    face_means(out, np.ascontiguousarray(cells), axis, periodic)
    return out


def control_volumes(
    cells: Array, opened: Faces, grid: Grid, boundaries: Boundaries
) -> ControlVolumes:
    """Control volumes of cells with these open volumes (m^3) and open parts of faces."""
    cells = np.ascontiguousarray(cells)
    found = [moving_volumes(axis, cells, opened, grid, boundaries) for axis in grid.axes]
    if grid.is_slab:
        found.append((np.zeros(grid.face_shape(2)), NONE, NONE_CLOSED, NO_TRANSFERS))
    (u, v, w), cut, closed, transfers = zip(*found, strict=True)
    return ControlVolumes(cells, (u, v, w), cut, closed, transfers, boundaries.periodic())


def moving_volumes(
    component: int, cells: Array, opened: Faces, grid: Grid, boundaries: Boundaries
) -> tuple[Array, Integers, Closed, Transfers]:
    """What moves with the faces across an axis, and what `ControlVolumes` has of them."""
    axis, shape, wraps = kernel_axes(component, grid, boundaries)
    told, ring, cell = boundaries.prescribed(component), wraps[axis] > 0, grid.cell_volume
    found, room, wide = (
        np.empty(grid.face_shape(component)),
        plane(cells, grid),
        planes(opened, grid),
    )
    volume, kinds = plane(found, grid), np.empty(shape, np.uint8)
    counts = np.empty((shape[0] * shape[1], 3), np.int64)
    limits = cell, WHOLE, SLACK * cell, NOTHING * cell
    sort_faces(volume, kinds, counts, room, wide[axis], axis, told, ring, limits)
    cut, shut, uneven = listed_kinds(kinds, counts)
    targets = find_targets(shut, kinds, wide[axis], volume, room, axis, wraps)
    closed = Closed(shut, *targets)
    given = shared_out(volume, closed, kinds, uneven, room, wide, axis, wraps, cell)
    if ring:
        found[edge(component, -1)] = found[edge(component, 0)]
    return found, cut, closed, given


def shared_out(
    volume: Array,
    closed: Closed,
    kinds: Marks,
    uneven: Integers,
    cells: Array,
    opened: Faces,
    axis: int,
    wraps: Integers,
    cell: float,
) -> Transfers:
    """What control volumes across `axis` give to others, taken from `volume` and added to it, in
    place; in the order of the kernels' axes.

    kinds   of the faces, see `sort_faces`
    uneven  (n,) those that have more or less than their opening says
    cell    volume of a whole one, m^3
    """
    own, shape, listed = opened[axis], np.array(volume.shape), uneven
    for _ in range(ROUNDS):
        listed = with_neighbours(listed, kinds, shape, wraps)
    held, part = (field.reshape(-1)[listed] for field in (volume, own))
    place, aim = np.unravel_index(listed, volume.shape)[axis], cell * part
    if wraps[axis] == 0:
        aim[(place == 0) | (place == shape[axis] - 1)] *= 0.5
    axes = [axis, *(other for other in range(3) if other != axis and shape[other] > 1)]
    ways = [
        openings(listed, kinds, axis, other, own, cells, cell, opened[other], shape, wraps)
        for other in axes
    ]
    given = [np.zeros(listed.size) for _ in axes]
    for turn in range(ROUNDS):
        for sweeps in (slice(0, 1), slice(1, None)):  # along its own axis, then all others together
            gained = np.zeros(listed.size)
            for sweep, (above, way, rest) in list(enumerate(ways))[sweeps]:
                after = held.copy()
                given[sweep] += even_out(after, aim, part, above, way, rest) / len(ways[sweeps])
                gained += (after - held) / len(ways[sweeps])
            held = held + gained
            if turn == sweeps.start == 0:  # what closes in a step comes in as it closes
                volume.reshape(-1)[listed] = held
                with np.errstate(invalid="ignore"):  # a flow that is no number is told later
                    lent = closed.shares * volume.reshape(-1)[closed.faces, None]
                merge_small(volume, closed.faces, closed.targets, closed.shares)
                held = volume.reshape(-1)[listed]
    volume.reshape(-1)[closed.faces[closed.shares.any(axis=1)]] = 0.0
    volume.reshape(-1)[listed] = held
    givers, takers, amounts = [listed] * len(axes), [], given
    for above, _, _ in ways:
        takers.append(np.where(above >= 0, listed[above], listed))
    for m in (0, 1):
        givers, takers = [*givers, closed.faces], [*takers, closed.targets[:, m]]
        amounts = [*amounts, lent[:, m]]
    giver, taker, amount = (np.concatenate(field) for field in (givers, takers, amounts))
    used = amount != 0.0
    return Transfers(giver[used], taker[used], amount[used])
