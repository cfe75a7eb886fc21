"""Finite volumes of the viscous system around the faces across one axis (see `fluid.viscosity`),
and its links on a vector of faces.

The velocity of a face is that at the centre of its open part; `centre` holds how far that is from
the centre of the whole face along the two other axes, in cells.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import prange

from flowborne.kernels.arrays import LEAST, PERIODIC, Array, Integers, Marks
from flowborne.kernels.control_volumes import indices, stride
from flowborne.kernels.cut_faces import SAME, closed_face, open_edge, other_axes
from flowborne.kernels.edge_crossings import Crossings
from flowborne.kernels.jit import inlined, kernel

INACTIVE, UNKNOWN, GIVEN = range(3)
"""A face is inside a body, solved for, or prescribed by a side."""

RUN = 64
"""Most faces that are linked together."""

Index = tuple[int, int, int]


class CutFaces(NamedTuple):
    """The faces across one axis, and what bodies leave open around them.

    axis       that
    kind       INACTIVE, UNKNOWN or GIVEN
    distance   to the bodies at the nodes, m
    crossings  of edges with them
    opened     open part of each face
    centre     (2, ...) of that, see the module
    parts      (nx, ny, nz) open part of each cell
    stiffness  mu A / h, kg/s
    """

    axis: int
    kind: Marks
    distance: Array
    crossings: Crossings
    opened: Array
    centre: Array
    parts: Array
    stiffness: float


@kernel
def face_distances(distance: Array, axis: int, near: float, out: Array) -> None:
    """Distance to the nearest body at the centres of the faces across `axis`, the mean of corners,
    less `near`."""
    ai, aj = int(axis != 0), int(axis == 0)
    bj, bk = int(axis == 2), int(axis != 2)
    for i in prange(out.shape[0]):
        for j in range(out.shape[1]):
            for k in range(out.shape[2]):
                total = distance[i, j, k] + distance[i + ai, j + aj, k]
                total = total + distance[i, j + bj, k + bk]
                total = total + distance[i + ai, j + aj + bj, k + bk]
                out[i, j, k] = 0.25 * total - near


@kernel
def find_centres(
    distance: Array, crossings: Crossings, axis: int, near: Integers, centre: Array, flat: bool
) -> None:
    """Centres of the open parts of the faces `near` (flat indices), in place.

    Walls are straight: between the arcs of a round body and the sides of a face there are crescents
    whose centres are in the body.

    centre  (2, ...) from the centre of each face across `axis`, along the other axes, cells
    """
    for f in near:
        i, j, k = indices(centre.shape[1:], f)
        closed, x, y, _, _, _ = closed_face(distance, crossings, axis, i, j, k, flat, True)
        if 0.0 < closed < 1.0:
            centre[0, i, j, k] = min(max(-x / (1.0 - closed), -0.5), 0.5)
            centre[1, i, j, k] = min(max(-y / (1.0 - closed), -0.5), 0.5)


@inlined
def face_along(face: Index, d: int, step: int, count: int, ring: bool) -> Index:
    """The face some steps along d from another one, among `count` distinct ones, around a periodic
    axis; below 0 along d beyond the domain."""
    at = face[d] + step
    if ring:
        at = (at + count) % count
    elif at >= count:
        at = -1
    return at if d == 0 else face[0], at if d == 1 else face[1], at if d == 2 else face[2]


@kernel
def nearest_node(distance: Array, i: int, j: int, k: int, ni: int, nj: int, nk: int) -> int:
    """Flat index of the node nearest to a body among those up to (ni, nj, nk) above (i, j, k)."""
    best, least = 0, np.inf
    for a in range(i, i + ni + 1):
        for b in range(j, j + nj + 1):
            for c in range(k, k + nk + 1):
                if distance[a, b, c] < least:
                    least = distance[a, b, c]
                    best = (a * distance.shape[1] + b) * distance.shape[2] + c
    return best


@kernel
def link_faces(
    faces: CutFaces,
    d: int,
    away: Array,
    velocity: Array,
    diagonal: Array,
    link: Array,
    given: Array,
    periodic: bool,
) -> None:
    """Add the links along d to the system of faces.

    Over that of open faces, the link of two across `axis` is the product of their open parts over
    that of the cell between them; of two beside each other the open part of the edge between them
    over the distance of the centres of their open parts.

    away      distance to bodies at each face; above 0 where it and its neighbours are uncut
    periodic  whether the domain is along d
    """
    axis, kind, distance, (at, part, bend, piece), opened, centre, parts, stiffness = faces
    shape, step, m = kind.shape, stride(kind.shape, d), int(d == other_axes(axis)[1])
    count = shape[d] - int(periodic and d == axis)
    kinds, far = kind.reshape(-1), away.reshape(-1)
    whole, links = diagonal.reshape(-1), link.reshape(-1)
    # columns along d of RUN faces side by side, or of one whose runs go along it
    wide, hop = (1, RUN) if step == 1 else ((step + RUN - 1) // RUN, step)
    hops = (count + RUN - 2) // RUN if step == 1 else count - 1
    for column in prange(kind.size // (shape[d] * step) * wide):
        row, place = np.int64(column) // wide, np.int64(column) % wide
        first = row * shape[d] * step + place * RUN
        crossings = Crossings(at, part, bend, piece)  # loops on threads take no tuple in a tuple
        for n in range(hops + int(periodic)):
            wraps = n == hops
            start = first + ((count - 1) * step if wraps else n * hop)
            onward = start + step - count * step * int(wraps)
            size = step - place * RUN if step > 1 or wraps else count - 1 - n * RUN
            stop = start + min(RUN, size)
            alike = link_alike(start, stop, onward, kinds, far, whole, links, stiffness)
            for other in range(stop if alike else start, stop):
                f, g = indices(shape, other), indices(shape, onward + other - start)
                i, j, k = f
                here, there = kind[f] == UNKNOWN, kind[g] == UNKNOWN
                known = kind[f] == GIVEN or kind[g] == GIVEN
                if not ((here and there) or (known and (here or there))):
                    continue
                coefficient = stiffness
                if away[f] <= 0.0 and d == axis:
                    room = max(parts[f], LEAST * max(opened[f], opened[g]))
                    coefficient *= opened[f] * opened[g] / room
                elif away[f] <= 0.0:
                    above = i + int(d == 0), j + int(d == 1), k + int(d == 2)
                    width = open_edge(distance, crossings, 3 - axis - d, *above)
                    apart = 1.0 + centre[m, g[0], g[1], g[2]] - centre[m, i, j, k]
                    coefficient *= width / max(apart, LEAST)
                if here:
                    diagonal[f] += coefficient
                if there:
                    diagonal[g] += coefficient
                if here and there:
                    link[f] = coefficient
                elif here:
                    given[f] += coefficient * velocity[g]
                else:
                    given[g] += coefficient * velocity[f]


@inlined
def link_alike(
    start: int, stop: int, onward: int, kinds: Marks, far: Array, diagonal: Array, links: Array,
    stiffness: float,
) -> bool:  # fmt: skip
    """`link_faces` on a run of faces and as many from `onward` on, all arrays flat; False and
    nothing where a body is near or a velocity is given. Places are unsigned: vector code."""
    a, b, size = np.uintp(start), np.uintp(onward), np.uintp(stop - start)
    given, near = np.uint8(0), 0
    for k in range(size):
        given |= np.uint8(kinds[a + k] == GIVEN) | np.uint8(kinds[b + k] == GIVEN)
    for k in range(size):
        near += far[a + k] <= 0.0
    if given or near:
        return False
    for k in range(size):
        both = (kinds[a + k] == UNKNOWN) & (kinds[b + k] == UNKNOWN)
        links[a + k] = stiffness if both else 0.0
    for k in range(size):
        diagonal[a + k] += links[a + k]
    for k in range(size):
        diagonal[b + k] += links[a + k]
    return True


@kernel
def meet_walls(
    faces: CutFaces, normal: Integers, beside: Integers
) -> tuple[Array, Array, Array, Integers]:
    """What walls do to the faces `beside` (n,), flat indices of unknown ones.

    Three walls each: in the plane of the face, in the cell below it and in that above it.

    normal   (3, 2) a of the velocity across the sides, see `fluid.sides.side`
    returns  (n, 3) W, kg/s, 0 where there is none; (n, 3, 3) from the wall point to the centre of
             the face's open part, cells; (n, 3, 3) from the centre of the face to the wall point,
             cells; (n, 3) flat index of the node nearest to a body
    """
    axis, kind, distance, crossings, opened, centre, parts, stiffness = faces
    wall, node = np.zeros((beside.size, 3)), np.zeros((beside.size, 3), np.int64)
    gap, place = np.zeros((beside.size, 3, 3)), np.zeros((beside.size, 3, 3))
    flat = parts.shape[2] == 1
    others = other_axes(axis)
    count = kind.shape[axis] - int(normal[axis, 0] == PERIODIC)
    total, pull = np.zeros(2), np.zeros(2)
    for n in range(beside.size):
        i, j, k = f = indices(kind.shape, beside[n])
        # in the plane: the wall that closes a part of the face, and closed faces beside it
        straight = 1.0 - closed_face(distance, crossings, axis, i, j, k, flat, True)[0]
        moment, stuck = 0.0, 0.0
        total[:], pull[:] = 0.0, 0.0
        for m in range(1 if flat else 2):
            d = others[m]
            for side in (-1, 1):
                upper = int(side > 0)
                edge = i + upper * int(d == 0), j + upper * int(d == 1), k + upper * int(d == 2)
                part = open_edge(distance, crossings, 3 - axis - d, *edge)
                away = max(0.5 - side * centre[m, i, j, k], LEAST)
                total[m] -= side * part
                moment += part * away
                g = face_along(f, d, side, kind.shape[d], normal[d, 0] == PERIODIC)
                if g[d] >= 0 and kind[g] != UNKNOWN and kind[g] != GIVEN:
                    stuck += part / away
                    pull[m] -= side * part
        size = np.sqrt((total**2).sum())
        cut = 0.0
        if size > SAME:
            # Gauss's theorem in the plane; an arc is at least half as far as its chord
            reach = (1.0 if flat else 2.0) * straight - moment
            bulge = 2.0 * (straight - opened[i, j, k])
            reach = max(max(reach - bulge, 0.5 * reach) / size, LEAST)
            cut = size / reach
            pull -= total
        elif straight == 0.0:
            cut = 1.0 / LEAST
        own_nodes = int(axis != 0), int(axis != 1), int(axis != 2)
        node[n, 0] = nearest_node(distance, i, j, k, *own_nodes)
        if cut + stuck > 0.0:
            wall[n, 0] = stiffness * (cut + stuck)
            for m in range(1 if flat else 2):
                gap[n, 0, others[m]] = pull[m] / (cut + stuck)
                place[n, 0, others[m]] = centre[m, i, j, k] - gap[n, 0, others[m]]
        # in the cells: the wall that makes one of two faces smaller than the other
        for side in (-1, 1):
            g = face_along(f, axis, side, count, normal[axis, 0] == PERIODIC)
            entry = 1 + int(side > 0)
            if g[axis] < 0:
                continue
            c = f if side > 0 else g
            active = kind[g] == UNKNOWN or kind[g] == GIVEN
            own, other = opened[f], opened[g] if active else 0.0
            if abs(own - other) < SAME:
                continue
            node[n, entry] = nearest_node(distance, c[0], c[1], c[2], 1, 1, 1)
            weight = own * (own - other) / max(parts[c], LEAST * max(own, other))
            wall[n, entry] = stiffness * weight
            place[n, entry, axis] = 0.5 * side
            gap[n, entry, axis] = -0.5 * side
            for m in range(1 if flat else 2):
                mine, yours = own * centre[m, i, j, k], other * centre[m, g[0], g[1], g[2]]
                where = min(max((mine - yours) / (own - other), -0.5), 0.5)
                place[n, entry, others[m]] = where
                gap[n, entry, others[m]] = centre[m, i, j, k] - where
    return wall, gap, place, node


@inlined
def beside(at: int, count: int, ring: int) -> tuple[int, int]:
    """The layers above and below one along an axis of `count`, of which `ring` are distinct where
    it is periodic, else 0; -1 where there is none."""
    above = 0 if at + 1 == ring else at + 1
    below = ring - 1 if at == 0 else at - 1
    return (above if above < count else -1), (below if at != ring else -1)


@inlined
def add_linked(total: Array, link: Array, scale: Array, x: Array) -> None:
    """Add link x scale x of the neighbours of a row, in place."""
    for k in range(total.size):
        total[k] += link[k] * scale[k] * x[k]


@kernel
def apply_component(out: Array, x: Array, scale: Array, links: Array, wraps: Integers) -> None:
    """out = x - scale sum of links (scale x) of the neighbours, for one component.

    wraps  (3,) number of distinct faces along each axis where the domain is periodic, else 0
    """
    u, v, w, a, b, c = links[0], links[1], links[2], wraps[0], wraps[1], wraps[2]
    if u.shape[2] == 1:  # a slab's rows along y
        shape = 1, u.shape[0], u.shape[1]
        u, v, w, a, b, c = w.reshape(shape), u.reshape(shape), v.reshape(shape), c, a, b
    ni, nj, nk = u.shape
    field, root, product = x.reshape(u.shape), scale.reshape(u.shape), out.reshape(u.shape)
    for row in prange(ni * nj):
        i, j = np.int64(row) // nj, np.int64(row) % nj
        total, own, size, link = product[i, j], field[i, j], root[i, j], w[i, j]
        total[:] = 0.0
        above, below = beside(i, ni, a)
        if above >= 0:
            add_linked(total, u[i, j], root[above, j], field[above, j])
        if below >= 0:
            add_linked(total, u[below, j], root[below, j], field[below, j])
        above, below = beside(j, nj, b)
        if above >= 0:
            add_linked(total, v[i, j], root[i, above], field[i, above])
        if below >= 0:
            add_linked(total, v[i, below], root[i, below], field[i, below])
        end = (c if c > 0 else nk) - 1
        add_linked(total[:end], link[:end], size[1 : end + 1], own[1 : end + 1])
        if c > 0:
            total[end] += link[end] * size[0] * own[0]
        add_linked(total[1 : end + 1], link[:end], size[:end], own[:end])
        if c > 0:
            total[0] += link[end] * size[end] * own[end]
        for k in range(nk):
            total[k] = own[k] - size[k] * total[k]
