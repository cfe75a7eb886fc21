"""Small and closed control volumes share their velocity with others: amounts are kept exactly.

Flat indices into the arrays of one component; lists are in ascending order, and are worked through
in it.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from flowborne.kernels.arrays import Array, Integers, Marks

TURNS = 2
"""Times that small control volumes are mixed: one beside another goes with what is behind that.
With one turn fluid leaves the creases of a swimmer at 4.1 times the speed of its links, with two at
less than 2.5 times."""

NONE = 1e-9
"""Open part of a face up to which it counts as closed."""


@njit(nogil=True, cache=True)
def neighbour(shape: Integers, wraps: Integers, f: int, way: int) -> int:
    """Flat index of the control volume beside f; -1 beyond the domain, and along an axis of one
    layer.

    wraps  (3,) number of distinct volumes along each periodic axis, else 0
    way    2 axis below f, 2 axis + 1 above
    """
    axis, side = way // 2, 2 * (way % 2) - 1
    if shape[axis] == 1:
        return -1
    n1, n2 = shape[1], shape[2]
    at = f // (n1 * n2) if axis == 0 else ((f // n2) % n1 if axis == 1 else f % n2)
    step = n1 * n2 if axis == 0 else (n2 if axis == 1 else 1)
    to = at + side
    if wraps[axis] > 0:
        if to < 0:
            return int(f + step * (wraps[axis] - 1))
        if to >= wraps[axis]:
            return int(f - step * at + step * (to - wraps[axis]))
    elif to < 0 or to >= shape[axis]:
        return -1
    return int(f + step * side)


@njit(nogil=True, cache=True)
def find_targets(
    small: Integers,
    driven: Marks,
    opened: Array,
    volumes: Array,
    cells: Array,
    component: int,
    wraps: Integers,
) -> tuple[Integers, Array]:
    """Targets (n, 2) of every small one, and which parts (n, 2) of it go with them; the small one
    itself where there is none.

    A face that is wholly closed has a control volume where a cell beside it is open in part. What
    lies there goes along with the opposite faces of both cells, in proportion to their open parts
    and to those of the cells; where both are closed with the neighbour that has the largest volume,
    else with the targets of a neighbour, which may have them from another.

    small    (n,) closed faces with a volume
    driven   1 where pressure acts on a face
    opened   open part of each face
    volumes  of each control volume
    cells    volume of each cell
    """
    targets, parts = np.empty((small.size, 2), np.int64), np.zeros((small.size, 2))
    shape, cell_shape = np.array(opened.shape), np.array(cells.shape)
    volume_flat = volumes.reshape(-1)
    open_flat, cell_flat, pushed = opened.reshape(-1), cells.reshape(-1), driven.reshape(-1)
    for n in range(small.size):
        f = small[n]
        targets[n, :] = f
        n1, n2 = shape[1], shape[2]
        i, j, k = f // (n1 * n2), (f // n2) % n1, f % n2
        for side in range(2):
            a = i - int(component == 0 and side == 0)
            b = j - int(component == 1 and side == 0)
            c = k - int(component == 2 and side == 0)
            if wraps[component] > 0:
                if component == 0:
                    a = (a + wraps[0]) % wraps[0]
                elif component == 1:
                    b = (b + wraps[1]) % wraps[1]
                else:
                    c = (c + wraps[2]) % wraps[2]
            outside = a < 0 or b < 0 or c < 0
            if outside or a >= cell_shape[0] or b >= cell_shape[1] or c >= cell_shape[2]:
                continue
            to = neighbour(shape, wraps, f, 2 * component + side)
            volume = cell_flat[(a * cell_shape[1] + b) * cell_shape[2] + c]
            if to >= 0 and pushed[to] and volume > 0.0:
                targets[n, side], parts[n, side] = to, open_flat[to] * volume
        total = parts[n, 0] + parts[n, 1]
        if total > 0.0:
            parts[n] /= total
            continue
        most = 0.0
        for way in range(6):
            to = neighbour(shape, wraps, f, way)
            if to >= 0 and pushed[to] and volume_flat[to] > most:
                targets[n, 0], parts[n, 0], most = to, 1.0, volume_flat[to]
    led = True
    while led:
        led, first, given = False, targets.copy(), parts.copy()
        for n in range(small.size):
            if given[n].any():
                continue
            most = -1.0
            for way in range(6):
                to = neighbour(shape, wraps, small[n], way)
                at = np.searchsorted(small, to) if to >= 0 else small.size
                found = at < small.size and small[at] == to and given[at].any()
                if found and volume_flat[to] > most:
                    targets[n], parts[n], most = first[at], given[at], volume_flat[to]
                    led = True
    return targets, parts


@njit(nogil=True, cache=True)
def merge_small(amount: Array, small: Integers, targets: Integers, shares: Array) -> None:
    """Give these shares (n, 2) of the amounts of small ones to their targets (n, 2), in place."""
    flat = amount.reshape(-1)
    for n in range(small.size):
        own = flat[small[n]]
        for m in range(2):
            given = shares[n, m] * own
            flat[targets[n, m]] += given
            flat[small[n]] -= given


@njit(nogil=True, cache=True)
def join_small(
    field: Array,
    volumes: Array,
    small: Integers,
    targets: Integers,
    shares: Array,
    nothing: float,
) -> None:
    """Give these shares (n, 2) of what small ones hold, and of their volumes, to their targets, in
    place.

    field    value of each control volume, what is left of the amount where there is no volume above
             `nothing`
    volumes  of each
    """
    flat, volume = field.reshape(-1), volumes.reshape(-1)
    for n in range(small.size):
        g = small[n]
        room = volume[g]
        held = flat[g] * (room if room > nothing else 1.0)
        for m in range(2):
            h, share = targets[n, m], shares[n, m]
            if share == 0.0:
                continue
            amount = share * held + flat[h] * (volume[h] if volume[h] > nothing else 1.0)
            volume[h] += share * room
            volume[g] -= share * room
            flat[h] = amount / (volume[h] if volume[h] > nothing else 1.0)


@njit(nogil=True, cache=True)
def fill_empty(
    field: Array,
    volumes: Array,
    listed: Integers,
    nothing: float,
    shape: Integers,
    wraps: Integers,
) -> None:
    """Give listed control volumes that hold nothing the mean of those beside them, in place."""
    flat, volume = field.reshape(-1), volumes.reshape(-1)
    for n in range(listed.size):
        f = listed[n]
        if volume[f] > nothing:
            continue
        total, weight = 0.0, 0.0
        for way in range(6):
            to = neighbour(shape, wraps, f, way)
            if to >= 0 and volume[to] > nothing:
                total += volume[to] * flat[to]
                weight += volume[to]
        if weight > 0.0:
            flat[f] = total / weight


@njit(nogil=True, cache=True)
def level(
    field: Array,
    volumes: Array,
    listed: Integers,
    leaving: Array,
    least: float,
    most: float,
    nothing: float,
    shape: Integers,
    wraps: Integers,
) -> None:
    """Mix listed control volumes with the largest one beside them, in place, where more leaves them
    than they hold.

    The exchange V_i V_t/(V_t + sum V_i) (u_t - u_i) levels out all that mix with one and keeps
    their sum (Hu et al. 2006): none of it up to `least` times what they hold, all of it from `most`
    times on, linear between. All exchange what they have at first.

    leaving  (n,) volume that leaves each in the substep
    """
    flat, volume = field.reshape(-1), volumes.reshape(-1)
    found, others, count = np.empty((2, listed.size), np.int64), {0: 0.0}, 0
    for n in range(listed.size):
        f = listed[n]
        own = volume[f]
        if own <= nothing or leaving[n] <= least * own:
            continue
        best, largest = -1, own
        for way in range(6):
            to = neighbour(shape, wraps, f, way)
            if to >= 0 and volume[to] > largest:
                best, largest = to, volume[to]
        if best >= 0:
            found[0, count], found[1, count] = n, best
            others[best] = others.get(best, 0.0) + own
            count += 1
    exchange = np.empty(count)
    for _ in range(TURNS):
        for m in range(count):
            f, best = listed[found[0, m]], found[1, m]
            own, all_of_it = volume[f], volume[best] + others[best]
            share = min((leaving[found[0, m]] / own - least) / (most - least), 1.0)
            exchange[m] = share * own * volume[best] / all_of_it * (flat[best] - flat[f])
        for m in range(count):
            f, best = listed[found[0, m]], found[1, m]
            flat[f] += exchange[m] / volume[f]
            flat[best] -= exchange[m] / volume[best]


@njit(nogil=True, cache=True)
def share_velocity(field: Array, small: Integers, targets: Integers, shares: Array) -> None:
    """Give small ones the velocity of all that goes with them, in place: these shares (n, 2) of
    them go with their targets (n, 2)."""
    flat, shared = field.reshape(-1), np.empty(small.size)
    for n in range(small.size):
        shared[n] = (1.0 - shares[n, 0] - shares[n, 1]) * flat[small[n]]
        shared[n] += shares[n, 0] * flat[targets[n, 0]] + shares[n, 1] * flat[targets[n, 1]]
    for n in range(small.size):
        flat[small[n]] = shared[n]


@njit(nogil=True, cache=True)
def mark_cut(marks: Marks, listed: Integers, shape: Integers, wraps: Integers) -> None:
    """Set to 0 the marks of listed control volumes, and of those along each axis that are no
    further from them than the marks' padding is deep, in place."""
    at, to = np.empty(3, np.int64), np.empty(3, np.int64)
    for f in listed:
        at[0], at[1], at[2] = f // (shape[1] * shape[2]), (f // shape[2]) % shape[1], f % shape[2]
        for axis in range(3):
            depth = (marks.shape[axis] - shape[axis]) // 2
            for other in range(3):
                to[other] = at[other] + (marks.shape[other] - shape[other]) // 2
            for shift in range(-depth, depth + 1):
                for image in range(-1, 2):
                    place = at[axis] + shift + image * wraps[axis]
                    if 0 <= place < shape[axis]:
                        to[axis] = place + depth
                        marks[to[0], to[1], to[2]] = 0


@njit(nogil=True, cache=True)
def find_parts(
    before: Array, after: Array, whole: float, component: int, wraps: Integers
) -> Integers:
    """Flat indices of the control volumes that are less than whole at one of two times.

    The first and last ones along a component's own axis are half as large, and the last is the
    first one where that is periodic.
    """
    n0, n1, n2 = before.shape
    found, count = np.empty(before.size, np.int64), 0
    last = before.shape[component] - 1
    ends = 0.0 if wraps[component] > 0 else 0.5 * whole
    for i in range(n0):
        for j in range(n1):
            one, two, low = before[i, j], after[i, j], 0
            at = i if component == 0 else j
            least = ends if component < 2 and (at == 0 or at == last) else whole
            if wraps[component] > 0 and component < 2 and at == 0:
                least = whole
            for k in range(n2):
                low += int(one[k] < least) | int(two[k] < least)
            if low == 0:
                continue
            for k in range(n2):
                bound = least
                if component == 2 and (k == last or (k == 0 and wraps[2] == 0)):
                    bound = ends
                if one[k] < bound or two[k] < bound:
                    found[count] = (i * n1 + j) * n2 + k
                    count += 1
    return found[:count].copy()


@njit(nogil=True, cache=True)
def find_closed(
    driven: Marks,
    opened: Array,
    volume: Array,
    component: int,
    prescribed: Marks,
    periodic: bool,
    nothing: float,
) -> Integers:
    """Flat indices of the faces of a component with a volume that pressure does not push: where
    the face or its volume is not above `nothing`.

    driven      1 where pressure acts on the face; given
    opened      open part of each face
    prescribed  (2,) 1 where the velocity of the first or last layer is prescribed: none of either
    periodic    whether the last layer is the first one, and counts once
    """
    n0, n1, n2 = opened.shape
    own, count = np.empty(opened.size, np.int64), 0
    last = opened.shape[component] - 1
    for i in range(n0):
        for j in range(n1):
            one, room, mark = opened[i, j], volume[i, j], driven[i, j]
            for k in range(n2):
                at = i if component == 0 else (j if component == 1 else k)
                told = (at == 0 and prescribed[0]) or (at == last and prescribed[1])
                double = at == last and periodic
                pushed = one[k] > NONE and room[k] > nothing
                mark[k] = pushed and not told and not double
                if not pushed and room[k] != 0.0 and not told and not double:
                    own[count] = (i * n1 + j) * n2 + k
                    count += 1
    return own[:count].copy()
