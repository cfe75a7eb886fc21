"""Volumes that move with the faces: control volumes whose excess over a h^3 goes to neighbours.

Flat indices into the arrays of one component; lists are in ascending order. `way` is 2 axis for the
neighbour below along an axis and 2 axis + 1 for the one above.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from flowborne.kernels.arrays import Array, Faces, Integers, Marks
from flowborne.kernels.control_volumes import (
    DRIVEN,
    LISTED,
    Closed,
    Transfers,
    across_axis,
    merge_small,
    neighbour,
    place_of,
)

KEPT = 0.5
"""Part of the smaller of what one holds and of a h^3 that it keeps at least in a sweep."""


ROUNDS = 2
"""Times that volumes are evened out along all axes, and so as many neighbours as take part. The
velocity on cut faces of the potential flow past a circle is off by 0.050, 0.025, 0.019 of the
stream (rms) with 8, 16, 32 cells to its diameter; with one round by 0.046, 0.043, 0.040, with three
by 0.061, 0.030, 0.018, and by 0.115, 0.135, 0.121 where control volumes keep what they have."""


@njit(nogil=True, cache=True)
def cell_beside(f: int, way: int, shape: Integers, wraps: Integers, component: int) -> int:
    """Flat index of the cell on one side of face f of a component; -1 beyond the domain."""
    n1, n2 = shape[1], shape[2]
    i, j, k = f // (n1 * n2), (f // n2) % n1, f % n2
    at = (i, j, k)[component] - 1 + way % 2
    count = shape[component] - 1
    if wraps[component] > 0:
        at %= count
    elif at < 0 or at >= count:
        return -1
    if component == 0:
        return int((at * n1 + j) * n2 + k)
    if component == 1:
        return int((i * (n1 - 1) + at) * n2 + k)
    return int((i * n1 + j) * (n2 - 1) + at)


@njit(nogil=True, cache=True)
def face_between(
    f: int, way: int, low: int, shape: Integers, wraps: Integers, component: int, across: Integers
) -> int:
    """Flat index of one of the two faces between control volume f and the one beside it along
    another axis: that at the lower (0) or upper (1) of its cells; -1 beyond the domain.

    across  (3,) shape of the faces across that axis
    """
    n1, n2 = shape[1], shape[2]
    axis = way // 2
    at = (f // (n1 * n2), (f // n2) % n1, f % n2)
    place, count, up = at[component] + low - 1, shape[component] - 1, way % 2
    if wraps[component] > 0:
        place %= count
    elif place < 0 or place >= count:
        return -1
    i = place if component == 0 else at[0] + up * int(axis == 0)
    j = place if component == 1 else at[1] + up * int(axis == 1)
    k = place if component == 2 else at[2] + up * int(axis == 2)
    return int((i * across[1] + j) * across[2] + k)


@njit(nogil=True, cache=True)
def openings(
    listed: Integers,
    kinds: Marks,
    component: int,
    axis: int,
    own: Array,
    cells: Array,
    cell: float,
    across: Array,
    shape: Integers,
    wraps: Integers,
) -> tuple[Integers, Array, Array]:
    """Place in the list (n,) of the control volume above each along an axis, -1 if it is not there,
    the opening w (n,) of the way to it, and what w a of others than listed ones is beside each.

    w is the open part of the cell between both along the component's own axis, elsewhere the mean
    of the two faces between them times the smaller one of their own.

    kinds   of the faces
    own     open part of each face of the component
    cells   open volume of each cell
    cell    volume of a whole one
    across  open part of the faces across the axis
    """
    above, way, rest = np.empty(listed.size, np.int64), np.zeros(listed.size), np.zeros(listed.size)
    faces, room, sides = own.reshape(-1), cells.reshape(-1), across.reshape(-1)
    wide, near = np.array(across.shape), [0, 0]
    for n in range(listed.size):
        f, above[n] = listed[n], -1
        for side in range(2):
            to = neighbour(shape, wraps, f, 2 * axis + side)
            if to < 0:
                continue
            at = near[side] = place_of(listed, to, near[side])
            there = at < listed.size and listed[at] == to
            if there and side == 0:
                continue
            if axis == component:
                part = room[cell_beside(f, side, shape, wraps, component)] / cell
                opening = min(max(part, 0.0), 1.0)
            else:
                total, count = 0.0, 0
                for low in range(2):
                    between = face_between(f, 2 * axis + side, low, shape, wraps, component, wide)
                    if between >= 0:
                        total += sides[between]
                        count += 1
                opening = total / count * min(faces[f], faces[to])
            if there:
                above[n], way[n] = at, opening
            elif kinds.reshape(-1)[to] & DRIVEN:
                rest[n] += opening * faces[to]
    return above, way, rest


@njit(nogil=True, cache=True)
def even_out(
    held: Array,
    goal: Array,
    opened: Array,
    above: Integers,
    way: Array,
    rest: Array,
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

    opened  (n,) a;  goal  (n,) a h^3;  above, way, rest  see `openings`
    """
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


@njit(nogil=True, cache=True)
def give(
    later: Array, net: Array, volume: Array, f: int, more: float, dt: float, nothing: float
) -> None:
    """Let more of its amount per time leave one control volume, in place; all flat.

    later   value after a stage of dt, what is left of the amount where `volume` is not above
            `nothing`
    net     amount that leaves per time
    volume  after the stage
    """
    net[f] += more
    later[f] -= dt * more / (volume[f] if volume[f] > nothing else 1.0)


@njit(nogil=True, cache=True)
def add_transfers(
    later: Array,
    net: Array,
    volume: Array,
    field: Array,
    given: Transfers,
    dt: float,
    nothing: float,
) -> None:
    """Let what transfers take leave control volumes and come to others, in place: volume per time
    x mean velocity of both, which changes no energy. See `give`."""
    after, leaving, held = later.reshape(-1), net.reshape(-1), volume.reshape(-1)
    values = field.reshape(-1)
    for n in range(given.givers.size):
        f, g = given.givers[n], given.takers[n]
        passed = given.volume[n] * 0.5 * (values[f] + values[g])
        give(after, leaving, held, f, passed, dt, nothing)
        give(after, leaving, held, g, -passed, dt, nothing)


@njit(nogil=True, cache=True)
def with_neighbours(cut: Integers, kinds: Marks, shape: Integers, wraps: Integers) -> Integers:
    """The listed ones, and then those beside them on which pressure acts.

    kinds  of the faces; on return LISTED too where a face is in the list
    """
    kind = kinds.reshape(-1)
    found, count = np.empty(7 * cut.size, np.int64), cut.size
    for n in range(count):
        found[n] = cut[n]
        kind[cut[n]] |= LISTED
    for f in cut:
        for way in range(6):
            to = neighbour(shape, wraps, f, way)
            if to >= 0 and kind[to] & DRIVEN and not kind[to] & LISTED:
                kind[to] |= LISTED
                found[count] = to
                count += 1
    return found[:count].copy()


@njit(nogil=True, cache=True)
def share_out(
    volume: Array,
    closed: Closed,
    kinds: Marks,
    listed: Integers,
    cells: Array,
    opened: Faces,
    component: int,
    wraps: Integers,
    cell: float,
) -> Transfers:
    """What control volumes of a component give to others, taken from `volume` and added to it, in
    place.

    kinds   of the faces, see `sort_faces`
    listed  (n,) those that have more or less than their opening says, and those around them
    cells   volumes
    cell    that of a whole one
    """
    own, shape = across_axis(opened, component), np.array(volume.shape)
    flat, part_flat, size = volume.reshape(-1), own.reshape(-1), listed.size
    stride = shape[1] * shape[2] if component == 0 else (shape[2] if component == 1 else 1)
    part, held, aim = np.empty(size), np.empty(size), np.empty(size)
    for n in range(size):
        f = listed[n]
        part[n], held[n], at = part_flat[f], flat[f], (f // stride) % shape[component]
        outer = wraps[component] == 0 and (at == 0 or at == shape[component] - 1)
        aim[n] = cell * part[n] * (0.5 if outer else 1.0)
    above, way = np.empty((3, size), np.int64), np.empty((3, size))
    rest, given, count = np.empty((3, size)), np.zeros((3, size)), 0
    for m in range(3):
        axis = component if m == 0 else m - int(m <= component)
        if shape[axis] > 1:
            above[count], way[count], rest[count] = openings(
                listed, kinds, component, axis, own, cells, cell, across_axis(opened, axis), shape,
                wraps,
            )  # fmt: skip
            count += 1
    shut, lent = closed.faces, np.zeros(closed.shares.shape)
    for turn in range(ROUNDS):
        for group in range(2):  # along its own axis, then all others together
            ways, gained = range(0, 1) if group == 0 else range(1, count), np.zeros(size)
            for m in ways:
                even_out(
                    held, aim, part, above[m], way[m], rest[m], 1.0 / len(ways), given[m], gained
                )
            for n in range(size):
                held[n] += gained[n]
                flat[listed[n]] = held[n]
            if turn == group == 0:  # what closes in a step comes in as it closes
                for n in range(shut.size):
                    for m in range(2):
                        lent[n, m] = closed.shares[n, m] * flat[shut[n]]
                merge_small(volume, shut, closed.targets, closed.shares)
                for n in range(size):
                    held[n] = flat[listed[n]]
    for n in range(shut.size):
        if closed.shares[n, 0] + closed.shares[n, 1] > 0.0:
            flat[shut[n]] = 0.0
    total = count * size + 2 * shut.size
    givers, takers, amounts = np.empty(total, np.int64), np.empty(total, np.int64), np.empty(total)
    at = 0
    for m in range(count):
        for n in range(size):
            if given[m, n] != 0.0:
                givers[at], takers[at] = listed[n], listed[above[m, n]]
                amounts[at] = given[m, n]
                at += 1
    for m in range(2):
        for n in range(shut.size):
            if lent[n, m] != 0.0:
                givers[at], takers[at], amounts[at] = shut[n], closed.targets[n, m], lent[n, m]
                at += 1
    return Transfers(givers[:at].copy(), takers[:at].copy(), amounts[:at].copy())
