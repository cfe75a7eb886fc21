"""The part of each face that bodies close, and the open volume of the cells: that of the polyhedron
that the open parts of its faces bound.

What several bodies close together is shared among them by what each closes alone.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flowborne.kernels.arrays import PERIODIC, PRESCRIBED, Array, Faces, Integers, Nodes
from flowborne.kernels.cut_faces import (
    SAME,
    closed_face,
    crossing_from,
    is_cut,
    nodes_inside,
    on_several_pieces,
    other_axes,
)
from flowborne.kernels.edge_crossings import Crossings
from flowborne.kernels.jit import inlined, kernel
from flowborne.kernels.triangles import along

Index = tuple[int, int, int]

CREASE = 0.02
"""Open part below which a face in a crease is closed. Bodies that overlap at a joint, or reach into
a side of the domain, press a cell that they never press in truth: what it has to lose would leave
through such a face, at a thousand times their speed."""


class Piece(NamedTuple):
    """A body or flesh, or an image of it, on the grid, and what it alone closes of the faces there.

    body       its number
    box        (3, 2) ranges of nodes
    nodes      displaced such that the body itself is there
    distance   to it at the nodes of the box, m
    crossings  of the edges between them
    share      part of each face that it closes
    centre     (2, ...) of that part, from that of the face along the other axes, cells
    """

    body: int
    box: Integers
    nodes: Nodes
    distance: Array
    crossings: Crossings
    share: Faces
    centre: Faces


@kernel
def close_faces(piece: Piece, total: Array, axis: int) -> None:
    """What one body alone closes of each face across `axis` in its box, in place; added to `total`,
    too."""
    own, centre = piece.share[axis], piece.centre[axis]
    box, flat, phi, found = piece.box, piece.nodes.flat, piece.distance, piece.crossings
    for i in range(own.shape[0]):
        for j in range(own.shape[1]):
            for k in range(own.shape[2]):
                closed = 1.0 if phi[i, j, k] < 0.0 else 0.0
                if is_cut(phi, found, axis, i, j, k):
                    closed = closed_part(centre, (i, j, k), phi, found, axis, (i, j, k), flat)
                own[i, j, k] = closed
                total[i + box[0, 0], j + box[1, 0], k + box[2, 0]] += closed


@inlined
def closed_part(
    centre: Array, at: Index, phi: Array, found: Crossings, axis: int, face: Index, flat: bool
) -> float:
    """Closed part of a face across `axis`; its centre is written to `centre`, at `at`."""
    i, j, k = face
    closed, x, y, _, _, _ = closed_face(phi, found, axis, i, j, k, flat, False)
    for m in range(2 if closed > 0.0 else 0):
        centre[m, at[0], at[1], at[2]] = min(max((x, y)[m] / closed, -0.5), 0.5)
    return closed


@kernel
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


@kernel
def in_a_crease(beside: Integers, axis: int, i: int, j: int, k: int, ring: bool) -> bool:
    """Whether two bodies, or a body and a side, bound one of the cells at face (i, j, k).

    ring  whether the axis is periodic
    """
    n, count = i if axis == 0 else (j if axis == 1 else k), beside.shape[axis]
    back = count if ring and n == 0 else 0
    for step, there in ((back - 1, n > 0 or ring), (-count * (n == count), n < count or ring)):
        x, y, z = i + step * (axis == 0), j + step * (axis == 1), k + step * (axis == 2)
        if there and beside[x, y, z] > 1:
            return True
    return False


@kernel
def share_closed(
    piece: Piece, opened: Array, total: Array, distance: Array, found: Crossings,
    beside: Integers, axis: int, ends: Integers,
) -> tuple[Integers, Array, Array]:  # fmt: skip
    """This body's parts of the closed faces across `axis` in its box, and the open fractions.

    piece     with what the body alone closes, overwritten by its part of what all bodies close, and
              the centres by those of that
    total     the sum of what each body alone closes
    distance, found  to all bodies at the nodes, and where edges cross any
    beside    (nx, ny, nz) how many bodies and solid sides bound each cell
    ends      (2,) a of the velocity across the sides on `axis`: at a PRESCRIBED one the side, not
              the body, decides what crosses
    returns   (n,) flat indices of the faces, (n,) its parts, and (n, 2) their centres
    """
    share, centre = piece.share[axis], piece.centre[axis]
    box, flat, count = piece.box, piece.nodes.flat, 0
    most, (_, nj, nk) = np.count_nonzero(share), opened.shape
    faces, part, middle = np.empty(most, np.int64), np.empty(most), np.empty((most, 2))
    last, ring = opened.shape[axis] - 1, ends[0] == PERIODIC
    for a in range(share.shape[0]):
        for b in range(share.shape[1]):
            for c in range(share.shape[2]):
                i, j, k = a + box[0, 0], b + box[1, 0], c + box[2, 0]
                own, all_own = share[a, b, c], total[i, j, k]
                if own == 0.0:
                    continue
                union = own
                if own != all_own:
                    union = closed_part(centre, (a, b, c), distance, found, axis, (i, j, k), flat)
                if union > 1.0 - CREASE and (
                    union > 1.0 - SAME or in_a_crease(beside, axis, i, j, k, ring)
                ):
                    union = 1.0
                    centre[:, a, b, c] = 0.0
                opened[i, j, k] = 1.0 - union
                n = i if axis == 0 else (j if axis == 1 else k)
                if (n == 0 and ends[0] == PRESCRIBED) or (n == last and ends[1] == PRESCRIBED):
                    share[a, b, c] = 0.0
                    continue
                share[a, b, c] = union * own / all_own
                if share[a, b, c] > 0.0:
                    faces[count], part[count] = (i * nj + j) * nk + k, share[a, b, c]
                    middle[count, 0], middle[count, 1] = centre[0, a, b, c], centre[1, a, b, c]
                    count += 1
    return faces[:count], part[:count], middle[:count]


@kernel
def wall_point(
    distance: Array, found: Crossings, i: int, j: int, k: int, point: Array, scratch: Array
) -> bool:
    """Find a point of the wall within cell (i, j, k), if it has one: triangles join it to where the
    wall meets the faces.

    Where the wall has an edge, the middle of this. A smooth wall is a paraboloid, whose tangent
    planes at the crossings pass its top twice as high as it is; a cone three quarters as high as
    they do has its volume.

    point    (3,) from the lower corner of the cell, cells, overwritten
    scratch  (3, 3)
    """
    middle, mean, place = scratch
    middle[:], mean[:] = 0.0, 0.0
    corners = 0
    for axis in range(3):
        s, t = other_axes(axis)
        for side in range(2):
            a, b, c = i + side * (axis == 0), j + side * (axis == 1), k + side * (axis == 2)
            face = axis, a, b, c
            if is_cut(distance, found, *face) and on_several_pieces(distance, found, *face):
                _, _, _, count, x, y = closed_face(distance, found, axis, a, b, c, False, False)
                corners += count
                middle[axis] += side * count
                middle[s] += x
                middle[t] += y
    if corners > 0:
        for m in range(3):
            point[m] = middle[m] / corners
        return True
    count, rise = 0, 0.0
    for d in range(3):
        s, t = other_axes(d)
        for n in range(4):
            place[s], place[t] = n // 2, n % 2
            place[d] = 0.0
            a, b, c = i + int(place[0]), j + int(place[1]), k + int(place[2])
            ends = distance[a, b, c], distance[a + int(d == 0), b + int(d == 1), c + int(d == 2)]
            for upper in range(2):
                near, far = ends[upper], ends[1 - upper]
                part, e = crossing_from(found, found.at[d, a, b, c], near, far, upper > 0)
                if part < 0.0:
                    continue
                place[d] = 1.0 - part if upper else part
                count += 1
                for m in range(3):
                    middle[m] += place[m]
                    if e >= 0:
                        mean[m] += found.normal[e, m]
                        rise += found.normal[e, m] * place[m]
    if count == 0:
        return False
    rise = (rise - along(mean, middle) / count) / max(np.sqrt(along(mean, mean)), 1e-300) / count
    for m in range(3):
        point[m] = min(max(middle[m] / count + 0.75 * rise * mean[m], 0.0), 1.0)
    return True


@kernel
def open_cells(
    volume: Array, whole: float, distance: Array, found: Crossings, opened: Faces, boxes: Integers
) -> None:
    """Open volume of the cells in boxes of nodes; 0 where all faces of a cell are closed.

    In a slab that over its cross-section, the open part of its faces across z; else the sum of the
    pyramids from a point of the wall over the open parts of the faces: its own triangles add none.

    volume    (nx, ny, nz), overwritten in the boxes
    whole     that of a whole cell
    distance  to the bodies at the nodes;  found  where edges cross these
    opened    open parts of the faces
    boxes     (n, 3, 2)
    """
    (ox, oy, oz), flat, todo = opened, volume.shape[2] == 1, -1.0
    point, scratch = np.empty(3), np.empty((3, 3))
    for box in boxes:
        volume[box[0, 0] : box[0, 1] - 1, box[1, 0] : box[1, 1] - 1, box[2, 0] : box[2, 1] - 1] = (
            todo
        )
    for box in boxes:
        for i in range(box[0, 0], box[0, 1] - 1):
            for j in range(box[1, 0], box[1, 1] - 1):
                for k in range(box[2, 0], box[2, 1] - 1):
                    if volume[i, j, k] != todo:
                        continue
                    shut = 4.0 - ox[i, j, k] - ox[i + 1, j, k] - oy[i, j, k] - oy[i, j + 1, k]
                    if not flat:
                        shut += 2.0 - oz[i, j, k] - oz[i, j, k + 1]
                    inside = nodes_inside(distance, 0, i, j, k)
                    inside += nodes_inside(distance, 0, i + 1, j, k)
                    part = 1.0
                    if shut == (4.0 if flat else 6.0) or inside == 8:
                        part = 0.0
                    elif inside == 0 and shut == 0.0:
                        part = 1.0
                    elif flat:
                        part = 1.0 - closed_face(distance, found, 2, i, j, k, True, False)[0]
                    elif wall_point(distance, found, i, j, k, point, scratch):
                        x, y, z = point
                        part = (
                            x * ox[i, j, k] + (1.0 - x) * ox[i + 1, j, k]
                            + y * oy[i, j, k] + (1.0 - y) * oy[i, j + 1, k]
                            + z * oz[i, j, k] + (1.0 - z) * oz[i, j, k + 1]
                        ) / 3.0  # fmt: skip
                        part = min(max(part, 0.0), 1.0)
                    volume[i, j, k] = part * whole
