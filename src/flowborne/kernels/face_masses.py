"""Volumes that move with the faces: control volumes whose excess over a h^3 goes to neighbours.

Flat indices into the arrays of one component; lists are in ascending order. `way` is 2 axis for the
neighbour below along an axis and 2 axis + 1 for the one above.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flowborne.kernels.arrays import Array, FaceGrid, Faces, Integers, Marks, Three
from flowborne.kernels.control_volumes import (
    DRIVEN,
    LISTED,
    Closed,
    Transfers,
    all_beside,
    both_beside,
    cell_beside,
    find_targets,
    indices,
    listed_kinds,
    merge_small,
    sort_faces,
    stride,
)
from flowborne.kernels.flux import Stage, in_line
from flowborne.kernels.jit import inlined, kernel
from flowborne.kernels.lists import place_of

KEPT = 0.5
"""Part of the smaller of what one holds and of a h^3 that it keeps at least in a sweep."""


ROUNDS = 2
"""Times that volumes are evened out along all axes, and so as many neighbours as take part. The
velocity on cut faces of the potential flow past a circle is off by 0.050, 0.025, 0.019 of the
stream (rms) with 8, 16, 32 cells to its diameter; with one round by 0.046, 0.043, 0.040, with three
by 0.061, 0.030, 0.018, and by 0.115, 0.135, 0.121 where control volumes keep what they have."""


class Openings(NamedTuple):
    """What is open between listed control volumes along one axis.

    above  (n,) place in the list of the control volume above each, -1 if it is not there
    way    (n,) opening w of the way to it
    rest   (n,) w a of the others beside each
    """

    above: Integers
    way: Array
    rest: Array


@inlined
def face_between(
    at: tuple[int, int, int], way: int, low: int, faces: FaceGrid, across: Three
) -> int:
    """Flat index of one of the two faces between the control volume at (i, j, k) and the one beside
    it along another axis: that at the lower (0) or upper (1) of its cells; -1 beyond the domain.

    across  shape of the faces across that axis
    """
    component, shape, wraps = faces
    axis, up = way // 2, way % 2
    place, count = at[component] + low - 1, shape[component] - 1
    if wraps[component] > 0:
        place += count * (int(place < 0) - int(place >= count))
    elif place < 0 or place >= count:
        return -1
    i = place if component == 0 else at[0] + up * int(axis == 0)
    j = place if component == 1 else at[1] + up * int(axis == 1)
    k = place if component == 2 else at[2] + up * int(axis == 2)
    return int((i * across[1] + j) * across[2] + k)


@kernel
def openings(
    listed: Integers,
    kinds: Marks,
    axis: int,
    opened: Faces,
    cells: Array,
    cell: float,
    faces: FaceGrid,
) -> Openings:
    """What is open between listed control volumes along an axis.

    w is the open part of the cell between both along the component's own axis, elsewhere the mean
    of the two faces between them times the smaller one of their own.

    kinds   of the faces; the listed ones are LISTED
    opened  open part of each
    cells   open volume of each cell
    cell    volume of a whole one
    """
    above, way, rest = np.empty(listed.size, np.int64), np.zeros(listed.size), np.zeros(listed.size)
    across, room = opened[axis], cells.reshape(-1)
    own, sides = opened[faces.component].reshape(-1), across.reshape(-1)
    wide, kind, near = across.shape, kinds.reshape(-1), 0
    step, count, ring = stride(faces.shape, axis), faces.shape[axis], faces.wraps[axis]
    for n in range(listed.size):
        f, above[n] = listed[n], -1
        at = indices(faces.shape, f)
        beside = both_beside(f, at[axis], step, count, ring)
        for side in range(2):
            to = beside[side]
            there = to >= 0 and kind[to] & LISTED != 0
            if to < 0 or (there and side == 0):
                continue
            if axis == faces.component:
                part = room[cell_beside(at, side, faces)] / cell
                opening = min(max(part, 0.0), 1.0)
            else:
                total, met = 0.0, 0
                for low in range(2):
                    between = face_between(at, 2 * axis + side, low, faces, wide)
                    if between >= 0:
                        total += sides[between]
                        met += 1
                opening = total / met * min(own[f], own[to])
            if there:
                near = place_of(listed, to, near)
                above[n], way[n] = near, opening
            elif kind[to] & DRIVEN:
                rest[n] += opening * own[to]
    return Openings(above, way, rest)


@kernel
def even_out(
    held: Array,
    goal: Array,
    opened: Array,
    between: Openings,
    share: float,
    passed: Array,
    gained: Array,
) -> None:
    """Add to `passed` this share of what each gives to the one above it along an axis in one sweep,
    and to `gained` what each has of it; all (n,).

        T = w (e_f a_g - e_g a_f) (a_f + a_g) / (a_g S_f + a_f S_g),   e = held - goal

    with S the sum of w a over both neighbours: in a row of equal openings each ends with the mean
    of both neighbours' excess. What is added up here has the same bits from either side, so that
    what is symmetric stays so.

    opened  (n,) a;  goal  (n,) a h^3
    """
    above, way, rest = between
    count, reach = held.size, rest.copy()
    given, out, more = np.zeros(count), np.zeros(count), np.zeros(count)
    for n in range(count):
        m = above[n]
        if m >= 0:
            reach[n] += way[n] * opened[m]
            reach[m] += way[n] * opened[n]
    for n in range(count):
        m = above[n]
        if m < 0 or way[n] == 0.0:
            continue
        a, b = opened[n], opened[m]
        skew = (held[n] - goal[n]) * b - (held[m] - goal[m]) * a
        given[n] = way[n] * skew * (a + b) / (b * reach[n] + a * reach[m])
        if given[n] > 0.0:
            out[n] += given[n]
        else:
            out[m] -= given[n]
    for n in range(count):
        spare = max(held[n] - KEPT * max(min(held[n], goal[n]), 0.0), 0.0)
        out[n] = min(spare / out[n], 1.0) if out[n] > 0.0 else 1.0
    for n in range(count):
        m = above[n]
        if m >= 0:
            given[n] *= share * (out[n] if given[n] > 0.0 else out[m])
            more[n] -= given[n]
            more[m] += given[n]
    for n in range(count):
        passed[n] += given[n]
        gained[n] += more[n]


@kernel
def give(now: Stage, f: int, more: float) -> None:
    """Let more of its amount per time leave one control volume after a stage, flat, in place."""
    now.kept[f] -= 0.5 * now.dt * more
    volume = now.volume[f] if now.volume[f] > now.nothing else 1.0
    now.later[f] -= now.weight * now.dt * more / volume


@kernel
def add_transfers(now: Stage, field: Array, given: Transfers) -> None:
    """Let what transfers take leave control volumes and come to others after a stage, in place:
    volume per time x mean velocity of both, which changes no energy.

    field  the component that is carried along
    """
    flat, values = in_line(now), field.reshape(-1)
    for n in range(given.givers.size):
        f, g = given.givers[n], given.takers[n]
        passed = given.volume[n] * 0.5 * (values[f] + values[g])
        give(flat, f, passed)
        give(flat, g, -passed)


@kernel
def with_neighbours(cut: Integers, kinds: Marks, faces: FaceGrid) -> Integers:
    """The listed ones, and then those beside them on which pressure acts.

    kinds  of the faces; on return LISTED too where a face is in the list
    """
    kind = kinds.reshape(-1)
    found, count = np.empty(7 * cut.size, np.int64), cut.size
    for n in range(count):
        found[n] = cut[n]
        kind[cut[n]] |= LISTED
    for f in cut:
        for to in all_beside(faces.shape, faces.wraps, f):
            if to >= 0 and kind[to] & DRIVEN and not kind[to] & LISTED:
                kind[to] |= LISTED
                found[count] = to
                count += 1
    return found[:count].copy()


@kernel
def share_out(
    volume: Array,
    closed: Closed,
    kinds: Marks,
    listed: Integers,
    cells: Array,
    opened: Faces,
    faces: FaceGrid,
    cell: float,
) -> Transfers:
    """What control volumes of a component give to others, taken from `volume` and added to it, in
    place.

    kinds   of the faces, see `sort_faces`
    listed  (n,) those that have more or less than their opening says, and those around them
    cells   volumes
    cell    that of a whole one
    """
    component, shape, wraps = faces
    flat, part_flat = volume.reshape(-1), opened[component].reshape(-1)
    size = listed.size
    part, held, aim = np.empty(size), np.empty(size), np.empty(size)
    for n in range(size):
        f = listed[n]
        part[n], held[n], at = part_flat[f], flat[f], indices(shape, f)[component]
        outer = wraps[component] == 0 and (at == 0 or at == shape[component] - 1)
        aim[n] = cell * part[n] * (0.5 if outer else 1.0)
    above, way = np.empty((3, size), np.int64), np.empty((3, size))
    rest, given, count = np.empty((3, size)), np.zeros((3, size)), 0
    for m in range(3):
        axis = component if m == 0 else m - int(m <= component)
        if shape[axis] > 1:
            between = openings(listed, kinds, axis, opened, cells, cell, faces)
            for n in range(size):
                above[count, n], way[count, n] = between.above[n], between.way[n]
                rest[count, n] = between.rest[n]
            count += 1
    shut, lent = closed.faces, np.empty(closed.shares.shape)
    for turn in range(ROUNDS):
        for group in range(2):  # along its own axis, then all others together
            ways, gained = range(0, 1) if group == 0 else range(1, count), np.zeros(size)
            for m in ways:
                between = Openings(above[m], way[m], rest[m])
                even_out(held, aim, part, between, 1.0 / len(ways), given[m], gained)
            for n in range(size):
                held[n] += gained[n]
                flat[listed[n]] = held[n]
            if turn == group == 0:  # what closes in a step comes in as it closes
                lent = merge_small(volume, closed)
                for n in range(size):
                    held[n] = flat[listed[n]]
    for n in range(shut.size):
        if closed.shares[n].any():
            flat[shut[n]] = 0.0
    total = count * size + lent.size
    givers, takers, amounts = np.empty(total, np.int64), np.empty(total, np.int64), np.empty(total)
    at = 0
    for m in range(count):
        for n in range(size):
            if given[m, n] != 0.0:
                givers[at], takers[at] = listed[n], listed[above[m, n]]
                amounts[at] = given[m, n]
                at += 1
    for m in range(6):
        for n in range(shut.size):
            if lent[n, m] != 0.0:
                givers[at], takers[at], amounts[at] = shut[n], closed.targets[n, m], lent[n, m]
                at += 1
    return Transfers(givers[:at].copy(), takers[:at].copy(), amounts[:at].copy())


@kernel
def find_moving(
    volume: Array,
    cells: Array,
    opened: Faces,
    faces: FaceGrid,
    ends: Integers,
    limits: tuple[float, float, float, float],
) -> tuple[Integers, Closed, Transfers]:
    """What moves with the faces of a component, in `volume`; gives those that are cut, the closed
    ones, and what control volumes gave to others.

    cells         volume of each cell
    ends, limits  see `sort_faces`
    """
    component, shape, _ = faces
    kinds = np.empty((shape[0], shape[1], shape[2]), np.uint8)
    counts, own = np.empty((shape[0] * shape[1], 3), np.int64), opened[component]
    sort_faces(volume, kinds, counts, cells, own, component, ends, limits)
    cut, shut, uneven = listed_kinds(kinds, counts)
    closed = find_targets(shut, kinds, own, volume, cells, faces, limits[3])
    for _ in range(ROUNDS):
        uneven = with_neighbours(uneven, kinds, faces)
        uneven.sort()
    return cut, closed, share_out(volume, closed, kinds, uneven, cells, opened, faces, limits[0])
