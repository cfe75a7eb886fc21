"""Eddies of two cells, taken away by opposite exchanges between the four faces around an edge.

Around an edge along an axis the circulation of the velocities u and v across the next two axes is

    G = (v_above - v_below) - (u_above - u_below)

u_above of the face that lies above the edge along the axis of v, and the reverse. Edges that lie
beside each other across their axis exchange, with the smallest volume V of the faces around both,

    q = part V (G - G_beside) / 64

What an edge gives in all is taken from v_above and u_below and added to the other two, each over
its own volume. So linear momentum stays, and a flow without circulation.

The kinetic energy falls by the sum E of q (G - G_beside), and rises by at most half of E where the
edges have one axis, and by at most E where they have three: an edge has four others beside it,
(G - G_beside)^2 <= 2 G^2 + 2 G_beside^2, and V G^2 is at most four times the sum of volume times
velocity squared over its faces, each of which is at two edges along an axis. An eddy of two cells
across the axis in uncut cells, of which each is the opposite of the four beside it, loses `part`.
"""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Indices, Integers, Three
from flowborne.kernels.control_volumes import indices, stride
from flowborne.kernels.jit import kernel


@kernel
def positions(shape: Integers, axis: int, wraps: Three, reach: int) -> Integers:
    """(3, n) what each index along each axis, counted from -reach on, adds to the flat one of an
    edge along `axis`; where there is none inside the domain, so much that the sum is below 0."""
    none = -shape[0] * shape[1] * shape[2]
    found = np.full((3, max(shape[0], shape[1], shape[2]) + 2 * reach + 1), none)
    for a in range(3):
        sides = int(a != axis and wraps[a] == 0)
        for n in range(found.shape[1]):
            at = (n - reach) % wraps[a] if wraps[a] > 0 else n - reach
            if sides <= at < shape[a] - sides:
                found[a, n] = at * stride(shape, a)
    return found


@kernel
def list_edges(
    number: Indices, cut: tuple[Integers, Integers], axis: int, wraps: Three, reach: int
) -> Integers:
    """Flat indices (n,) of edges inside the domain around which a face is cut or up to `reach`
    faces away from a cut one along an axis; their numbers are set to 1.

    number  of the edges along `axis`, 0 before
    cut     flat indices of cut faces across the next two axes
    wraps   (3,) number of distinct edges along each periodic axis, else 0
    """
    marks, shape = number.reshape(-1), np.array(number.shape)
    adds = positions(shape, axis, wraps, reach)
    found, count = np.empty(marks.size, np.int64), 0
    for m in range(2):
        across, up = (axis + 1 + m) % 3, (axis + 2 - m) % 3
        n1 = shape[1] - int(axis != 1 and across != 1)
        n2 = shape[2] - int(axis != 2 and across != 2)
        for f in cut[m]:
            i, j, k = indices((shape[0], n1, n2), f)
            i, j, k = i + reach, j + reach, k + reach
            for _ in range(2):
                for way in range(3):
                    for shift in range(-reach, reach + 1):
                        e = adds[0, i + shift * int(way == 0)]
                        e += adds[1, j + shift * int(way == 1)]
                        e += adds[2, k + shift * int(way == 2)]
                        if e >= 0 and marks[e] == 0:
                            marks[e], found[count] = 1, e
                            count += 1
                i, j, k = i + int(up == 0), j + int(up == 1), k + int(up == 2)
    return found[:count].copy()


@kernel
def edges_near(
    number: Indices,
    volumes: tuple[Array, Array],
    cut: tuple[Integers, Integers],
    axis: int,
    wraps: Three,
    reach: int,
) -> tuple[Integers, Integers, Array]:
    """Edges of `list_edges` with four open faces: (n, 4) those faces, u below and above, v below
    and above; (n, 4) the places of the edges beside each, below and above along the axis of u and
    of v, -1 if not listed; and (n,) the smallest volume of each.

    volumes  that move with the faces across the next two axes, 0 at closed ones
    """
    listed, kept = list_edges(number, cut, axis, wraps, reach), 0
    one, other, marks, shape = (axis + 1) % 3, (axis + 2) % 3, number.reshape(-1), number.shape
    faces, beside = np.empty((listed.size, 4), np.int64), np.empty((listed.size, 4), np.int64)
    least = np.full(listed.size, np.inf)
    for m in range(2):
        along, held = other if m == 0 else one, volumes[m].reshape(-1)
        wide, ring = volumes[m].shape, wraps[along]
        step = stride(wide, along)
        for n in range(listed.size):
            at = indices(shape, listed[n])
            above = (at[0] * wide[1] + at[1]) * wide[2] + at[2]
            below = above + step * ((ring if at[along] == 0 else 0) - 1)
            faces[n, 2 * m], faces[n, 2 * m + 1] = below, above
            least[n] = min(least[n], held[below], held[above])
    for n in range(listed.size):
        e = listed[n]
        marks[e] = 0
        if least[n] > 0.0:
            listed[kept], least[kept] = e, least[n]
            for side in range(4):
                faces[kept, side] = faces[n, side]
            kept += 1
            marks[e] = kept
    for m in range(2):
        a = one if m == 0 else other
        step, ring = stride(shape, a), wraps[a]
        for n in range(kept):
            e = listed[n]
            place = indices(shape, e)[a]
            down = (ring if place == 0 else 0) - 1
            up = 1 - (ring if place == ring - 1 else 0)
            beside[n, 2 * m] = marks[e + down * step] - 1
            beside[n, 2 * m + 1] = marks[e + up * step] - 1
    return faces[:kept], beside[:kept], least[:kept]


@kernel
def exchanges(
    u: Array, v: Array, faces: Integers, beside: Integers, least: Array, rate: float
) -> Array:
    """(n,) what edges give in all, volume times velocity.

    faces, beside, least  see `edges_near`
    rate                  `part` over the mean speeds along both axes, added up; it is at most 1
    """
    u, v, size = u.reshape(-1), v.reshape(-1), least.size
    circulation, part, given = np.empty(size), np.empty(size), np.empty(size)
    for n in range(size):
        a, b, c, d = u[faces[n, 0]], u[faces[n, 1]], v[faces[n, 2]], v[faces[n, 3]]
        circulation[n] = (d - c) - (b - a)
        part[n] = min(0.5 * rate * (abs(a + b) + abs(c + d)), 1.0)
    for n in range(size):
        total = 0.0
        for axis in range(2):
            both = 0.0
            for side in range(2):
                m = beside[n, 2 * axis + side]
                if m >= 0:
                    volume = 0.5 * (part[n] + part[m]) * min(least[n], least[m])
                    both += volume * (circulation[n] - circulation[m])
            total += both
        given[n] = total / 64.0
    return given


@kernel
def exchanges_near(
    flow: tuple[Array, Array],
    volumes: tuple[Array, Array],
    cut: tuple[Integers, Integers],
    axis: int,
    wraps: Three,
    reach: int,
    rate: float,
) -> tuple[Integers, Integers, Array]:
    """Faces and places of `edges_near`, and what these edges give of the velocities `flow`, see
    `exchanges`."""
    (u, v), n = flow, np.array(flow[0].shape)
    n[(axis + 2) % 3] += 1
    number = np.zeros((n[0], n[1], n[2]), np.int32)
    faces, beside, least = edges_near(number, volumes, cut, axis, wraps, reach)
    return faces, beside, exchanges(u, v, faces, beside, least, rate)


@kernel
def exchange(
    u: Array, v: Array, volumes: tuple[Array, Array], faces: Integers, beside: Integers,
    given: Array,
) -> None:  # fmt: skip
    """Let edges give what they give, in place. What a face gets from both of its edges has the same
    bits from either side."""
    for m in range(2):
        field, volume = (u if m == 0 else v).reshape(-1), volumes[m].reshape(-1)
        sign = 1.0 - 2.0 * m
        for n in range(given.size):
            below, above = faces[n, 2 * m], faces[n, 2 * m + 1]
            before, beyond = beside[n, 2 - 2 * m], beside[n, 3 - 2 * m]
            more = given[n] - (given[beyond] if beyond >= 0 else 0.0)
            field[above] += sign * more / volume[above]
            if before < 0:
                field[below] -= sign * given[n] / volume[below]
