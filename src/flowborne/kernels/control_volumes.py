"""Small and closed control volumes share their velocity with others: amounts are kept exactly.

Flat indices into the arrays of one component; lists are in ascending order, and are worked through
in it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import prange

from flowborne.kernels.arrays import PERIODIC, PRESCRIBED, Array, FaceGrid, Integers, Marks, Three
from flowborne.kernels.faces import mean_row
from flowborne.kernels.jit import inlined, kernel
from flowborne.kernels.lists import place_of

DRIVEN, PART, SHUT, UNEVEN, LISTED = 1, 2, 4, 8, 16
"""Kinds of faces: pressure acts on it; its control volume is not whole; pressure does not act on
it, and it has one; its control volume is not what its opening says; it is in a list."""


class Closed(NamedTuple):
    """Faces of one component that pressure does not push; what they hold goes to their targets.

    faces    (n,) flat; one that is a target comes after those that give to it
    targets  (n, 6) flat, beside each, see `all_beside`; itself where that is none
    shares   (n, 6) of each target
    """

    faces: Integers
    targets: Integers
    shares: Array


class Transfers(NamedTuple):
    """Volumes that control volumes of one component give to others.

    givers, takers  (n,) flat
    volume          (n,) m^3; what is below 0 goes the other way
    """

    givers: Integers
    takers: Integers
    volume: Array


@inlined
def indices(shape: Three | Integers, f: int) -> tuple[int, int, int]:
    """(i, j, k) of a flat index; divided in 32 bits, as 64 take longer."""
    row = int(np.int64(np.uint32(f) // np.uint32(shape[2])))
    i = int(np.int64(np.uint32(row) // np.uint32(shape[1])))
    return i, row - i * shape[1], f - row * shape[2]


@inlined
def stride(shape: Three | Integers, axis: int) -> int:
    """Places between neighbours along an axis in a flat field."""
    return shape[1] * shape[2] if axis == 0 else (shape[2] if axis == 1 else 1)


@inlined
def both_beside(f: int, at: int, step: int, count: int, ring: int) -> tuple[int, int]:
    """Flat indices of the control volumes below and above f along an axis; -1 beyond the domain,
    and along an axis of one layer.

    at     index of f along the axis
    step   between neighbours there
    count  of the layers
    ring   number of distinct ones along a periodic axis, else 0
    """
    below, above = f - step, f + step
    if ring > 0:
        below += step * ring * int(at == 0)
        above -= step * ring * int(at + 1 >= ring)
    else:
        below = below if at > 0 else -1
        above = above if at + 1 < count else -1
    return (below, above) if count > 1 else (-1, -1)


@inlined
def all_beside(shape: Three, wraps: Three, f: int) -> tuple[int, int, int, int, int, int]:
    """Flat indices of the control volumes beside f: 2 axis for the one below, 2 axis + 1 for the
    one above, see `both_beside`. An array of them takes six times as long.

    wraps  (3,) number of distinct volumes along each periodic axis, else 0
    """
    i, j, k = indices(shape, f)
    a, b = both_beside(f, i, shape[1] * shape[2], shape[0], wraps[0])
    c, d = both_beside(f, j, shape[2], shape[1], wraps[1])
    return (a, b, c, d, *both_beside(f, k, 1, shape[2], wraps[2]))


@inlined
def cell_beside(at: tuple[int, int, int], upper: int, faces: FaceGrid) -> int:
    """Flat index of the cell below or above the face at (i, j, k) of a component; -1 beyond the
    domain."""
    component, shape, wraps = faces
    (i, j, k), n1, n2, count = at, shape[1], shape[2], shape[component] - 1
    place = at[component] - 1 + upper
    if wraps[component] > 0:
        place += count * (int(place < 0) - int(place >= count))
    elif place < 0 or place >= count:
        return -1
    if component == 0:
        return int((place * n1 + j) * n2 + k)
    if component == 1:
        return int((i * (n1 - 1) + place) * n2 + k)
    return int((i * n1 + j) * (n2 - 1) + place)


@kernel
def neighbour(shape: Three | Integers, wraps: Three | Integers, f: int, way: int) -> int:
    """Flat index of one control volume beside f; `way` as in `all_beside`."""
    return int(all_beside(shape, wraps, f)[way])


@inlined
def scale_to_one(parts: Array) -> bool:
    """Make the sum of parts 1, in place; False where there are none."""
    total = 0.0
    for part in parts:
        total += part
    for n in range(parts.size if total > 0.0 else 0):
        parts[n] /= total
    return total > 0.0


@kernel
def find_targets(
    small: Integers,
    kinds: Marks,
    opened: Array,
    volumes: Array,
    cells: Array,
    faces: FaceGrid,
    nothing: float,
) -> Closed:
    """Where what closed faces hold goes.

    A face that is wholly closed has a control volume where a cell beside it is open in part. What
    lies there goes along with the opposite faces of both cells, in proportion to their open parts
    and to those of the cells; what lies in a cell whose opposite face is closed, with the open
    neighbours across the other axes in proportion to their volumes, so that nothing passes through
    a body. Where there are none of either, it goes with closed ones that have targets.

    small    (n,) closed faces with a volume
    kinds    of the faces, see `sort_faces`
    opened   open part of each face
    volumes  of each control volume
    cells    volume of each cell
    nothing  volume up to which a cell holds nothing: it is what a solve left
    """
    targets, parts = np.empty((small.size, 6), np.int64), np.zeros((small.size, 6))
    turn, last = np.full(small.size, -1), 0
    component, shape, wraps = faces
    volume_flat, open_flat = volumes.reshape(-1), opened.reshape(-1)
    cell_flat, pushed = cells.reshape(-1), kinds.reshape(-1)
    for n in range(small.size):
        f = small[n]
        targets[n, :] = f
        at, beside = indices(shape, f), all_beside(shape, wraps, f)
        around, ahead, shut = 0.0, 0.0, 0.0
        for way in range(6):
            to = beside[way]
            if way // 2 != component and to >= 0 and pushed[to] & DRIVEN:
                targets[n, way], parts[n, way] = to, volume_flat[to]
                around += volume_flat[to]
        for side in range(2):
            way, cell = 2 * component + side, cell_beside(at, side, faces)
            to, volume = beside[way], cell_flat[cell] if cell >= 0 else 0.0
            if volume <= nothing:
                continue
            if to >= 0 and pushed[to] & DRIVEN:
                targets[n, way], parts[n, way] = to, open_flat[to] * volume
                ahead += parts[n, way]
            else:
                shut += volume
        for way in range(6) if ahead > 0.0 and around > 0.0 else range(0):
            if way // 2 != component:
                parts[n, way] *= shut / around
        if scale_to_one(parts[n]):
            turn[n] = 0
    led = True
    while led:
        led = False
        for n in range(small.size):
            if turn[n] >= 0:
                continue
            beside = all_beside(shape, wraps, small[n])
            for way in range(6):
                to = beside[way]
                m = place_of(small, to, 0) if to >= 0 else small.size
                if m < small.size and small[m] == to and 0 <= turn[m] <= last:
                    targets[n, way], parts[n, way] = to, max(volume_flat[to], nothing)
            if scale_to_one(parts[n]):
                turn[n], led = last + 1, True
        last += int(led)
    order, count = np.empty(small.size, np.int64), 0
    for own in range(last, -2, -1):
        for n in range(small.size):
            if turn[n] == own:
                order[count] = n
                count += 1
    return Closed(small[order], targets[order], parts[order])


@kernel
def merge_small(amount: Array, closed: Closed) -> Array:
    """Give the targets of closed ones their shares of what these have of an amount, in place; gives
    what (n, 6) each target got."""
    flat, (small, targets, shares) = amount.reshape(-1), closed
    given = np.zeros(shares.shape)
    for n in range(small.size):
        own = flat[small[n]]
        for m in range(6):
            if shares[n, m] > 0.0:
                given[n, m] = shares[n, m] * own
                flat[targets[n, m]] += given[n, m]
                flat[small[n]] -= given[n, m]
    return given


@kernel
def join_small(field: Array, volumes: Array, closed: Closed, nothing: float) -> None:
    """Give the targets of closed ones their shares of what these hold, and of their volumes, in
    place.

    field    value of each control volume, what is left of the amount where there is no volume above
             `nothing`
    volumes  of each
    """
    flat, volume, (small, targets, shares) = field.reshape(-1), volumes.reshape(-1), closed
    for n in range(small.size):
        g = small[n]
        room = volume[g]
        held = flat[g] * (room if room > nothing else 1.0)
        for m in range(6):
            h, share = targets[n, m], shares[n, m]
            if share == 0.0:
                continue
            amount = share * held + flat[h] * (volume[h] if volume[h] > nothing else 1.0)
            volume[h] += share * room
            volume[g] -= share * room
            flat[h] = amount / (volume[h] if volume[h] > nothing else 1.0)


@kernel
def fill_empty(
    field: Array, volumes: Array, listed: Integers, nothing: float, faces: FaceGrid
) -> None:
    """Give listed control volumes that hold nothing the mean of those beside them, in place."""
    flat, volume = field.reshape(-1), volumes.reshape(-1)
    for n in range(listed.size):
        f = listed[n]
        if volume[f] > nothing:
            continue
        total, weight = 0.0, 0.0
        for to in all_beside(faces.shape, faces.wraps, f):
            if to >= 0 and volume[to] > nothing:
                total += volume[to] * flat[to]
                weight += volume[to]
        if weight > 0.0:
            flat[f] = total / weight


@kernel
def level(
    field: Array,
    volumes: Array,
    listed: Integers,
    leaving: Array,
    nought: Array,
    nothing: float,
    faces: FaceGrid,
) -> None:
    """Mix listed control volumes with the largest one beside them, in place, where far more leaves
    them than they hold.

    All parts s V_i that mix with one and its V_t get their mean velocity (Hu et al. 2006 for one).
    Where c times what a volume holds leaves it, Heun's method keeps g = 1 - c + c^2/2 of what it
    had, more than all of it from c = 2 on, and s = 1 - 1/g leaves it all. All exchange what they
    have at first.

    leaving  (n,) volume that leaves each in the substep
    nought   as large as the field, 0 before and after
    """
    flat, volume, total = field.reshape(-1), volumes.reshape(-1), nought.reshape(-1)
    found, count = np.empty((2, listed.size), np.int64), 0
    part, whole, exchange = np.empty(listed.size), np.empty(listed.size), np.empty(listed.size)
    for n in range(listed.size):
        f = listed[n]
        own = volume[f]
        if own <= nothing or leaving[n] <= 2.0 * own:
            continue
        best, largest = np.int64(-1), own
        for to in all_beside(faces.shape, faces.wraps, f):
            if to >= 0 and volume[to] > largest:
                best, largest = to, volume[to]
        if best >= 0:
            found[0, count], found[1, count] = f, best
            c = leaving[n] / own
            part[count] = (1.0 - 1.0 / (1.0 - c + 0.5 * c * c)) * own
            total[best] += part[count]
            count += 1
    for m in range(count):
        whole[m] = volume[found[1, m]] + total[found[1, m]]
    total[found[1, :count]] = 0.0
    for m in range(count):
        f, best = found[0, m], found[1, m]
        total[best] += part[m] * (flat[f] - flat[best])
    for m in range(count):
        f, best = found[0, m], found[1, m]
        exchange[m] = part[m] * (total[best] / whole[m] - (flat[f] - flat[best]))
    for m in range(count):
        f, best = found[0, m], found[1, m]
        flat[f] += exchange[m] / volume[f]
        flat[best] -= exchange[m] / volume[best]
    total[found[1, :count]] = 0.0


@kernel
def share_velocity(field: Array, closed: Closed) -> None:
    """Give closed ones the velocity of all that goes with them, in place: their shares with their
    targets."""
    flat, (small, targets, shares) = field.reshape(-1), closed
    for n in range(small.size - 1, -1, -1):
        shared, given = 0.0, 0.0
        for m in range(6):
            shared += shares[n, m] * flat[targets[n, m]]
            given += shares[n, m]
        flat[small[n]] = (1.0 - given) * flat[small[n]] + shared


@kernel
def mark_cut(marks: Marks, listed: Integers, shape: Three, wraps: Three, reach: int) -> None:
    """Set to 0 the marks, padded or not, of listed places of a field of this shape, and of those up
    to `reach` beyond them along each axis, in place."""
    n1, n2, flat = shape[1], shape[2], marks.reshape(-1)
    d0, d1 = (marks.shape[0] - shape[0]) // 2, (marks.shape[1] - n1) // 2
    d2 = (marks.shape[2] - n2) // 2
    for f in listed:
        at = indices(shape, f)
        own = ((at[0] + d0) * marks.shape[1] + at[1] + d1) * marks.shape[2] + at[2] + d2
        for axis in range(3):
            step = stride(marks.shape, axis)
            for shift in range(-reach, reach + 1):
                for image in range(-1, 2) if wraps[axis] > 0 else range(0, 1):
                    away = shift + image * wraps[axis]
                    if 0 <= at[axis] + away < shape[axis]:
                        flat[own + away * step] = 0


@inlined
def kind_of(
    volume: float, opened: float, least: float, goal: float, slack: float, nothing: float, own: bool
) -> int:
    """What a face is: DRIVEN, PART, SHUT and UNEVEN, added up.

    least  volume below which it is cut
    goal   what it would move if it were open
    own    whether its velocity is not prescribed, and it is not another one
    """
    pushed = own and opened > 0.0 and volume > nothing
    shut = own and not pushed and volume != 0.0
    uneven = pushed and abs(volume - goal * opened) > slack
    return DRIVEN * pushed + PART * (volume < least) + SHUT * shut + UNEVEN * uneven


@inlined
def cancels(cells: Array, i: int, j: int, k: int, axis: int) -> bool:
    """Whether both cells of a face across an axis hold something, and their mean is 0."""
    at = i if axis == 0 else (j if axis == 1 else k)
    return at < cells.shape[axis] and cells[i, j, k] != 0.0


@kernel
def sort_faces(
    volumes: Array,
    kinds: Marks,
    counts: Integers,
    cells: Array,
    opened: Array,
    component: int,
    ends: Integers,
    limits: tuple[float, float, float, float],
) -> None:
    """Control volumes of the faces of a component, V_f = (V_L + V_R) / 2, and their kinds.

    The first and last ones along its own axis are half as large, and the last is the first one
    where that is periodic: it counts as none.

    kinds   see `kind_of`
    counts  (n0 n1, 3) in each row how many are PART, SHUT and UNEVEN
    ends    (2,) a of the velocity on the first and the last layer, see `fluid.sides.side`
    limits  volume of a cell; part of it below which control volumes are cut; `slack` and
            `nothing`, see `kind_of`
    """
    n0, n1, n2 = opened.shape
    last, (cell, bound, slack, nothing) = opened.shape[component] - 1, limits
    periodic = ends[0] == PERIODIC
    for row in prange(n0 * n1):
        i, j = np.int64(row) // n1, np.int64(row) % n1
        at = i if component == 0 else j
        volume, kind, part = volumes[i, j], kinds[i, j], opened[i, j]
        mean_row(volume, cells, i, j, component, periodic)
        parts, shut, uneven = 0, 0, 0
        for end in range(3):  # the middle of the row first, then both of its ends
            start, stop = 0, n2
            if end > 0:
                if component != 2:
                    break
                start = at = 0 if end == 1 else last
                stop = start + 1
            elif component == 2:
                at, start, stop = 1, 1, last
            outer = at == 0 or at == last
            double = periodic and at == last
            own = not double and not (at == 0 and ends[0] == PRESCRIBED)
            own = own and not (at == last and ends[1] == PRESCRIBED)
            least = bound * (0.0 if double else (0.5 if outer and not periodic else 1.0))
            goal = cell * (0.5 if outer and not periodic else 1.0)
            least, odd = least * cell, 0
            held, opening, kind[start:stop] = volume[start:stop], part[start:stop], DRIVEN * own
            for k in range(held.size):
                whole = (opening[k] == 1.0) & (held[k] >= least) & (held[k] > nothing)
                odd += not (whole & (abs(held[k] - goal) <= slack))
            if odd == 0:
                continue
            for k in range(start, stop):
                kind[k] = kind_of(volume[k], part[k], least, goal, slack, nothing, own)
                if own and volume[k] == 0.0 and cancels(cells, i, j, k, component):
                    kind[k] |= SHUT
                parts += (kind[k] & PART) // PART
                shut += (kind[k] & SHUT) // SHUT
                uneven += (kind[k] & UNEVEN) // UNEVEN
        counts[row, 0], counts[row, 1], counts[row, 2] = parts, shut, uneven


@kernel
def listed_kinds(kinds: Marks, counts: Integers) -> tuple[Integers, Integers, Integers]:
    """Flat indices of the faces that are PART, SHUT and UNEVEN, see `sort_faces`."""
    flat, width, total = kinds.reshape(-1), kinds.shape[2], np.zeros(3, np.int64)
    for row in range(counts.shape[0]):
        for kind in range(3):
            total[kind] += counts[row, kind]
    parts, shut = np.empty(total[0], np.int64), np.empty(total[1], np.int64)
    uneven, a, b, c = np.empty(total[2], np.int64), 0, 0, 0
    for row in range(counts.shape[0]):
        if counts[row, 0] + counts[row, 1] + counts[row, 2] == 0:
            continue
        for f in range(row * width, (row + 1) * width):
            if flat[f] & PART:
                parts[a] = f
                a += 1
            if flat[f] & SHUT:
                shut[b] = f
                b += 1
            if flat[f] & UNEVEN:
                uneven[c] = f
                c += 1
    return parts, shut, uneven
