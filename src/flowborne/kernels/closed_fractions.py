"""The part of each face that bodies close.

The closed part of a face is the area of the polygon that its four corner distances cut out (Ng,
Min and Gibou 2009), so it changes smoothly as a joint turns. What several bodies close together
is shared among them by what each closes alone.
"""

from __future__ import annotations

from numba import njit

from flowborne.kernels.arrays import Array, Integers
from flowborne.kernels.sides import CLOSED, PERIODIC

CREASE = 0.02
"""Open part below which a face in a crease is closed. Bodies that overlap at a joint, or reach into
a side of the domain, press a cell that they never press in truth: what it has to lose would leave
through such a face, at a thousand times their speed."""


@njit(nogil=True, cache=True)
def closed_fraction(a: float, b: float, c: float, d: float) -> float:
    """Part of a unit square with corner distances a, b, c, d (in turn) where distance < 0."""
    if a >= 0.0 and b >= 0.0 and c >= 0.0 and d >= 0.0:
        return 0.0
    if a < 0.0 and b < 0.0 and c < 0.0 and d < 0.0:
        return 1.0
    corner_x, corner_y = (0.0, 1.0, 1.0, 0.0), (0.0, 0.0, 1.0, 1.0)
    value = (a, b, c, d)
    twice, started = 0.0, False
    first_x, first_y, last_x, last_y = 0.0, 0.0, 0.0, 0.0
    for n in range(4):
        m = (n + 1) % 4
        for part in range(2):
            if part == 0:
                if value[n] >= 0.0:
                    continue
                x, y = corner_x[n], corner_y[n]
            else:
                if (value[n] < 0.0) == (value[m] < 0.0):
                    continue
                t = value[n] / (value[n] - value[m])
                x = corner_x[n] + t * (corner_x[m] - corner_x[n])
                y = corner_y[n] + t * (corner_y[m] - corner_y[n])
            if started:
                twice += last_x * y - x * last_y
            else:
                first_x, first_y, started = x, y, True
            last_x, last_y = x, y
    twice += last_x * first_y - first_x * last_y
    return min(max(0.5 * twice, 0.0), 1.0)


@njit(nogil=True, cache=True)
def face_closed(phi: Array, axis: int, i: int, j: int, k: int) -> float:
    """Closed part of face (i, j, k) across `axis` from node distances."""
    if axis == 0:
        return closed_fraction(
            phi[i, j, k], phi[i, j + 1, k], phi[i, j + 1, k + 1], phi[i, j, k + 1]
        )
    if axis == 1:
        return closed_fraction(
            phi[i, j, k], phi[i + 1, j, k], phi[i + 1, j, k + 1], phi[i, j, k + 1]
        )
    return closed_fraction(phi[i, j, k], phi[i + 1, j, k], phi[i + 1, j + 1, k], phi[i, j + 1, k])


@njit(nogil=True, cache=True)
def add_closed(total: Array, phi: Array, box: Integers, axis: int) -> None:
    """Add to `total` what one body alone closes of each face across `axis`."""
    upper = box[:, 1] - 1
    upper[axis] += 1
    for i in range(box[0, 0], upper[0]):
        for j in range(box[1, 0], upper[1]):
            for k in range(box[2, 0], upper[2]):
                total[i, j, k] += face_closed(
                    phi, axis, i - box[0, 0], j - box[1, 0], k - box[2, 0]
                )


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
    share: Array,
    opened: Array,
    total: Array,
    distance: Array,
    beside: Integers,
    phi: Array,
    box: Integers,
    axis: int,
    codes: Integers,
) -> int:
    """This body's part of each closed face in its box, and the open fractions; counts parts.

    beside (nx, ny, nz) how many bodies and solid sides bound each cell
    codes  (2,) of the lower and upper side across `axis`, see `sides`: at a CLOSED one the side,
           not the body, decides what crosses
    """
    upper = box[:, 1] - 1
    upper[axis] += 1
    count = 0
    last, ring = opened.shape[axis] - 1, codes[0] == PERIODIC
    for i in range(box[0, 0], upper[0]):
        for j in range(box[1, 0], upper[1]):
            for k in range(box[2, 0], upper[2]):
                a, b, c = i - box[0, 0], j - box[1, 0], k - box[2, 0]
                share[a, b, c] = 0.0
                n = i if axis == 0 else (j if axis == 1 else k)
                if total[i, j, k] == 0.0:
                    continue
                union = face_closed(distance, axis, i, j, k)
                if union > 1.0 - CREASE and (
                    union > 1.0 - 1e-9 or in_a_crease(beside, axis, i, j, k, ring)
                ):
                    union = 1.0
                opened[i, j, k] = 1.0 - union
                if (n == 0 and codes[0] == CLOSED) or (n == last and codes[1] == CLOSED):
                    continue
                own = face_closed(phi, axis, a, b, c)
                share[a, b, c] = union * own / total[i, j, k]
                if share[a, b, c] > 0.0:
                    count += 1
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
