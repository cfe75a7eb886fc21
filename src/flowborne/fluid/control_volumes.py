"""Control volumes of the faces: one mass for everything that a face's velocity stands for.

The control volume of a face reaches from the middle of one of its cells to that of the other,

    V_f = (V_L + V_R) / 2

so it obeys the same law as the cells, with the means of their fluxes through its sides (Verstappen
and Veldman 2003). A face that is wholly closed is pushed by no pressure: what is left of its
control volume, a guest, moves with another, its host. So does the part of a control volume that is
too large for the opening of its face.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.ghosts import edge
from flowborne.fluid.grid import Array, Faces, Grid
from flowborne.kernels.arrays import Integers
from flowborne.kernels.control_volumes import (
    find_hosts,
    find_parts,
    follow_hosts,
    merge_guests,
    share_velocity,
)

WHOLE = 0.99
"""Control volumes of this part of the largest one count as uncut."""

NARROW = 3.0
"""Control volume over open part x cell beyond which the rest of it is a guest: pressure on a narrow
opening would have to move all of it."""

NOTHING = 1e-9
"""Part of a cell below which a control volume holds nothing."""


@dataclass(frozen=True)
class ControlVolumes:
    """The control volumes of one geometry.

    cells   (nx, ny, nz) open volume of each cell, m^3
    volume  Faces, V_f, m^3; along a periodic axis the last is the first one
    merged  Faces, the same with that of the guests at their hosts, m^3
    guests  (n,) of each axis, flat indices
    hosts   (n,) of each axis; a guest without a host is its own
    shares  (n,) of each axis, part of a guest that goes with its host
    """

    cells: Array
    volume: Faces
    merged: Faces
    guests: tuple[Integers, Integers, Integers]
    hosts: tuple[Integers, Integers, Integers]
    shares: Faces

    def follow(self, velocity: Faces, grid: Grid) -> None:
        """Give guests that have nothing of their own the velocity of their hosts, in place."""
        for axis in grid.axes:
            whole = self.shares[axis] == 1.0
            follow_hosts(velocity[axis], self.guests[axis][whole], self.hosts[axis][whole])

    def mean_velocity(self, velocity: Array, axis: int) -> Array:
        """That of each control volume across `axis`, guests with what goes with their hosts."""
        mean = velocity.copy()
        share_velocity(mean, self.guests[axis], self.hosts[axis], self.shares[axis])
        return mean


def means(cells: Array, axis: int, periodic: bool) -> Array:
    """Mean of both cells of each face across `axis`; 0 beyond the sides of the domain."""
    ends = [(int(a == axis), int(a == axis)) for a in range(3)]
    wide = np.pad(cells, ends, mode="wrap" if periodic else "constant")
    return np.asarray(0.5 * (wide[edge(axis, slice(None, -1))] + wide[edge(axis, slice(1, None))]))


def wrapping(component: int, grid: Grid, boundaries: Boundaries) -> Integers:
    """(3,) number of distinct faces across `component` along each periodic axis, else 0."""
    counts = np.array(grid.shape, np.int64)
    return counts * np.array(boundaries.periodic(), np.int64)


def prescribed_layers(component: int, boundaries: Boundaries) -> list[tuple[int | slice, ...]]:
    """Index of each layer of faces whose normal velocity a side of the domain prescribes."""
    pair = boundaries.pair(component)
    return [
        edge(component, -1 if end else 0)
        for end, side in enumerate(pair)
        if side.kind not in ("open", "periodic")
    ]


def find_guests(
    opened: Array, volume: Array, axis: int, periodic: bool, grid: Grid
) -> tuple[Integers, Array]:
    """Flat indices of the guests among the faces across `axis`, and which part of each is one.

    opened  open part of each face, below 0 where a side of the domain prescribes the velocity
    """
    pushed = NARROW * grid.cell_volume * opened
    guest = (opened >= 0.0) & (volume != 0.0) & ((pushed < volume) | (pushed == 0.0))
    if periodic:
        guest[edge(axis, -1)] = False
    own = np.flatnonzero(guest)
    closed = pushed.reshape(-1)[own] == 0.0
    ratio = pushed.reshape(-1)[own] / np.where(closed, 1.0, volume.reshape(-1)[own])
    return own, np.where(closed, 1.0, 1.0 - ratio)


def settled(guests: Integers, hosts: Integers, shares: Array) -> tuple[Integers, Integers, Array]:
    """The guests but for those in part that found no host."""
    kept = (guests != hosts) | (shares == 1.0)
    return guests[kept], hosts[kept], shares[kept]


def control_volumes(
    cells: Array, opened: Faces, grid: Grid, boundaries: Boundaries
) -> ControlVolumes:
    """Control volumes of cells with these open volumes (m^3) and open parts of faces."""
    volumes, merged, guests, hosts, shares = [], [], [], [], []
    periodic = boundaries.periodic()
    for axis in range(3):
        volume = means(cells, axis, periodic[axis])
        volumes.append(volume)
        total, none = volume.copy(), np.zeros(0, np.int64)
        own, host, part = none, none, np.zeros(0)
        if axis in grid.axes:
            driven = opened[axis].copy()
            for layer in prescribed_layers(axis, boundaries):
                driven[layer] = -1.0
            wraps = wrapping(axis, grid, boundaries)
            driven[(volume <= NOTHING * grid.cell_volume) & (driven > 0.0)] = 0.0
            own, part = find_guests(driven, volume, axis, periodic[axis], grid)
            driven.reshape(-1)[own] = 0.0
            host = find_hosts(own, driven, volume, cells, axis, wraps)
            own, host, part = settled(own, host, part)
            merge_guests(total, own, host, part)
            if periodic[axis]:
                total[edge(axis, -1)] = total[edge(axis, 0)]
        merged.append(total)
        guests.append(own)
        hosts.append(host)
        shares.append(part)
    return ControlVolumes(
        cells,
        (volumes[0], volumes[1], volumes[2]),
        (merged[0], merged[1], merged[2]),
        (guests[0], guests[1], guests[2]),
        (hosts[0], hosts[1], hosts[2]),
        (shares[0], shares[1], shares[2]),
    )


def parts(before: Array, after: Array, component: int, grid: Grid, sides: Boundaries) -> Integers:
    """Flat indices of the control volumes that are cut at one of two times."""
    whole = WHOLE * max(float(before.max()), float(after.max()))
    wraps = wrapping(component, grid, sides)
    return np.asarray(find_parts(before, after, whole, component, np.array(before.shape), wraps))
