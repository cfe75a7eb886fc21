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

import numpy as np

from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.ghosts import edge
from flowborne.fluid.grid import Array, Faces, Grid
from flowborne.kernels.arrays import Integers, Marks
from flowborne.kernels.control_volumes import (
    find_closed,
    find_parts,
    find_targets,
    merge_small,
    share_velocity,
)
from flowborne.kernels.face_masses import even_out, find_cut, openings, with_neighbours
from flowborne.kernels.faces import face_means

WHOLE = 0.99
"""Control volumes of this part of the largest one count as uncut."""

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


@dataclass(frozen=True)
class Closed:
    """Faces of one component that pressure does not push; what they hold goes to their targets.

    index    (n,) flat
    targets  (n, 2) flat; one without a target is its own
    shares   (n, 2) of each target
    """

    index: Integers
    targets: Integers
    shares: Array

    def follow(self, velocity: Array) -> None:
        """Give them the velocity of their targets, in place."""
        share_velocity(velocity, self.index, self.targets, self.shares)


@dataclass(frozen=True)
class Transfers:
    """Volumes that control volumes of one component give to others.

    givers, takers  (n,) flat
    volume          (n,) m^3; what is below 0 goes the other way
    """

    givers: Integers
    takers: Integers
    volume: Array


@dataclass(frozen=True)
class ControlVolumes:
    """The control volumes of one geometry.

    cells      (nx, ny, nz) open volume of each cell, m^3
    volume     Faces, V_f, m^3; along a periodic axis the last is the first one
    moving     Faces, M_f, what moves with each face, m^3; 0 at closed ones
    closed     of each axis
    transfers  of each axis, from V_f to M_f
    """

    cells: Array
    volume: Faces
    moving: Faces
    closed: tuple[Closed, Closed, Closed]
    transfers: tuple[Transfers, Transfers, Transfers]

    def follow(self, velocity: Faces, grid: Grid) -> None:
        """Give closed faces the velocity of their targets, in place."""
        for axis in grid.axes:
            self.closed[axis].follow(velocity[axis])


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
    volumes, moving, closed, transfers = [], [], [], []
    periodic = boundaries.periodic()
    part = (cells / grid.cell_volume).clip(0.0, 1.0)
    for axis in range(3):
        volume = means(cells, axis, periodic[axis])
        total, none = volume.copy(), np.zeros(0, np.int64)
        shut = Closed(none, np.zeros((0, 2), np.int64), np.zeros((0, 2)))
        given = Transfers(none, none, np.zeros(0))
        if axis in grid.axes:
            wraps, driven = wrapping(axis, grid, boundaries), np.empty(volume.shape, np.uint8)
            told, ring = boundaries.prescribed(axis), periodic[axis]
            nothing = NOTHING * grid.cell_volume
            own = find_closed(driven, opened[axis], volume, axis, told, ring, nothing)
            target, share = find_targets(own, driven, opened[axis], volume, cells, axis, wraps)
            shut = Closed(own, target, share)
            given = shared_out(total, shut, driven, part, opened, axis, grid, boundaries)
            if ring:
                total[edge(axis, -1)] = total[edge(axis, 0)]
        volumes.append(volume)
        moving.append(total)
        closed.append(shut)
        transfers.append(given)
    return ControlVolumes(
        cells,
        (volumes[0], volumes[1], volumes[2]),
        (moving[0], moving[1], moving[2]),
        (closed[0], closed[1], closed[2]),
        (transfers[0], transfers[1], transfers[2]),
    )


def shared_out(
    volume: Array,
    closed: Closed,
    driven: Marks,
    cells: Array,
    opened: Faces,
    axis: int,
    grid: Grid,
    sides: Boundaries,
) -> Transfers:
    """What control volumes across `axis` give to others, taken from `volume` and added to it, in
    place.

    driven  1 where pressure acts on the face
    cells   (nx, ny, nz) open part of each cell
    """
    own, wraps = opened[axis], wrapping(axis, grid, sides)
    goal, shape = grid.cell_volume * own, np.array(own.shape)
    if wraps[axis] == 0:
        goal[edge(axis, 0)] *= 0.5
        goal[edge(axis, -1)] *= 0.5
    listed = find_cut(volume, goal, SLACK * grid.cell_volume, driven)
    for _ in range(ROUNDS):
        listed = with_neighbours(listed, driven, shape, wraps)
    held, aim, part = (field.reshape(-1)[listed] for field in (volume, goal, own))
    axes = [axis, *(other for other in grid.axes if other != axis)]
    ways = [
        openings(listed, driven, axis, other, own, cells, opened[other], shape, wraps)
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
                    lent = closed.shares * volume.reshape(-1)[closed.index, None]
                merge_small(volume, closed.index, closed.targets, closed.shares)
                held = volume.reshape(-1)[listed]
    volume.reshape(-1)[closed.index[closed.shares.any(axis=1)]] = 0.0
    volume.reshape(-1)[listed] = held
    givers, takers, amounts = [listed] * len(axes), [], given
    for above, _, _ in ways:
        takers.append(np.where(above >= 0, listed[above], listed))
    for m in (0, 1):
        givers, takers = [*givers, closed.index], [*takers, closed.targets[:, m]]
        amounts = [*amounts, lent[:, m]]
    giver, taker, amount = (np.concatenate(field) for field in (givers, takers, amounts))
    used = amount != 0.0
    return Transfers(giver[used], taker[used], amount[used])


def parts(before: Array, after: Array, component: int, grid: Grid, sides: Boundaries) -> Integers:
    """Flat indices of the control volumes that are cut at one of two times."""
    whole = WHOLE * max(float(before.max()), float(after.max()))
    wraps = wrapping(component, grid, sides)
    return np.asarray(find_parts(before, after, whole, component, wraps))
