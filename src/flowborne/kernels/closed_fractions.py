"""The part of each face that bodies close.

What several bodies close together is shared among them by what each closes alone.
"""

from __future__ import annotations

from numba import njit

from flowborne.kernels.arrays import CLOSED, PERIODIC, Array, Integers
from flowborne.kernels.cut_faces import closed_face, is_cut
from flowborne.kernels.edge_crossings import Crossings

CREASE = 0.02
"""Open part below which a face in a crease is closed. Bodies that overlap at a joint, or reach into
a side of the domain, press a cell that they never press in truth: what it has to lose would leave
through such a face, at a thousand times their speed."""


@njit(nogil=True, cache=True)
def close_faces(
    own: Array, total: Array, phi: Array, found: Crossings, box: Integers, axis: int, flat: bool
) -> None:
    """What one body alone closes of each face across `axis` in its box; added to `total`, too."""
    for i in range(own.shape[0]):
        for j in range(own.shape[1]):
            for k in range(own.shape[2]):
                closed = 1.0 if phi[i, j, k] < 0.0 else 0.0
                if is_cut(phi, found, axis, i, j, k):
                    closed = closed_face(phi, found, axis, i, j, k, flat, False)[0]
                own[i, j, k] = closed
                total[i + box[0, 0], j + box[1, 0], k + box[2, 0]] += closed


@njit(nogil=True, cache=True)
def count_beside(beside: Integers, phi: Array, box: Integers, count: int) -> None:
    """Add `count` to the cells of which one body covers a corner."""
    for i in range(box[0, 0], box[0, 1] - 1):
        for j in range(box[1, 0], box[1, 1] - 1):
            for k in range(box[2, 0], box[2, 1] - 1):
                a, b, c = i - box[0, 0], j - box[1, 0], k - box[2, 0]
                deepest = min(
                    min(phi[a, b, c], phi[a, b, c + 1]),
                    min(phi[a, b + 1, c], phi[a, b + 1, c + 1]),
                    min(phi[a + 1, b, c], phi[a + 1, b, c + 1]),
                    min(phi[a + 1, b + 1, c], phi[a + 1, b + 1, c + 1]),
                )
                if deepest < 0.0:
                    beside[i, j, k] += count


@njit(nogil=True, cache=True)
def in_a_crease(beside: Integers, axis: int, i: int, j: int, k: int, ring: bool) -> bool:
    """Whether two bodies, or a body and a side, bound one of the cells at face (i, j, k).

    ring  whether the axis is periodic
    """
    n, count = i if axis == 0 else (j if axis == 1 else k), beside.shape[axis]
    back = count if ring and n == 0 else 0
    x, y, z = (
        i + (back - 1) * (axis == 0),
        j + (back - 1) * (axis == 1),
        k + (back - 1) * (axis == 2),
    )
    low = (n > 0 or ring) and beside[x, y, z] > 1
    back = count if ring and n == count else 0
    x, y, z = i - back * (axis == 0), j - back * (axis == 1), k - back * (axis == 2)
    return bool(low or ((n < count or ring) and beside[x, y, z] > 1))


@njit(nogil=True, cache=True)
def share_closed(
    share: Array, opened: Array, total: Array, distance: Array, found: Crossings, beside: Integers,
    box: Integers, axis: int, codes: Integers, flat: bool,
) -> int:  # fmt: skip
    """This body's part of each closed face in its box, and the open fractions; counts parts.

    share     what the body alone closes, overwritten
    total     the sum of what each body alone closes
    distance, found  to all bodies at the nodes, and where edges cross any
    beside    (nx, ny, nz) how many bodies and solid sides bound each cell
    codes     (2,) of the lower and upper side across `axis`, see `sides`: at a CLOSED one the side,
              not the body, decides what crosses
    """
    count = 0
    last, ring = opened.shape[axis] - 1, codes[0] == PERIODIC
    for a in range(share.shape[0]):
        for b in range(share.shape[1]):
            for c in range(share.shape[2]):
                i, j, k = a + box[0, 0], b + box[1, 0], c + box[2, 0]
                own, all_own = share[a, b, c], total[i, j, k]
                if own == 0.0:
                    continue
                union = own
                if own != all_own:
                    union = closed_face(distance, found, axis, i, j, k, flat, False)[0]
                if union > 1.0 - CREASE and (
                    union > 1.0 - 1e-9 or in_a_crease(beside, axis, i, j, k, ring)
                ):
                    union = 1.0
                opened[i, j, k] = 1.0 - union
                n = i if axis == 0 else (j if axis == 1 else k)
                if (n == 0 and codes[0] == CLOSED) or (n == last and codes[1] == CLOSED):
                    share[a, b, c] = 0.0
                    continue
                share[a, b, c] = union * own / all_own
                count += int(share[a, b, c] > 0.0)
    return count


@njit(nogil=True, cache=True)
def list_closed(
    share: Array,
    box: Integers,
    axis: int,
    body: int,
    counts: Integers,
    at: int,
    out_axis: Integers,
    out_face: Integers,
    out_body: Integers,
    out_closed: Array,
) -> int:
    """Write one body's closed parts across `axis` from position `at` on; gives the next one."""
    upper = box[:, 1] - 1
    upper[axis] += 1
    for i in range(box[0, 0], upper[0]):
        for j in range(box[1, 0], upper[1]):
            for k in range(box[2, 0], upper[2]):
                closed = share[i - box[0, 0], j - box[1, 0], k - box[2, 0]]
                if closed > 0.0:
                    out_axis[at] = axis
                    out_face[at] = (i * counts[1] + j) * counts[2] + k
                    out_body[at] = body
                    out_closed[at] = closed
                    at += 1
    return at
