"""Rows of J: what unit pressure in a cell beside closed faces exerts on bodies and vertices; and
the velocity that these give to closed parts of faces."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flowborne.kernels.arrays import PRESCRIBED, Array, Integers, Kinds, Mask, Rows
from flowborne.kernels.closed_fractions import Piece
from flowborne.kernels.jit import inlined, kernel

ENCLOSED, COVERED, NARROW, WIDE = 0, 1, 2, 3
"""Kinds of cells: closed in by bodies and solid sides of the domain; all faces closed by bodies; an
open face, but none by half; a face open by half or more."""


class ClosedParts(NamedTuple):
    """What bodies close of faces, one entry per face and body.

    axis, face      (n,) axis of the face, and its flat index among those across that axis
    body, part      (n,) the body, and the fraction that it closes
    place           (n, 3) centre of what bodies close of the face, of the whole face where flesh
                    does; at the body itself where an image closes it, m
    corner, weight  (nf, 3) vertices that move the last nf of them, closed by flesh, and how much
                    each does
    """

    axis: Integers
    face: Integers
    body: Integers
    part: Array
    place: Array
    corner: Integers
    weight: Array


@inlined
def through(normal: Integers, axis: int, end: int, at_end: bool) -> float:
    """0 for a face on a side that prescribes the flux through it, 1 for others."""
    return 0.0 if at_end and normal[axis, end] == PRESCRIBED else 1.0


@kernel
def kinds_of_cells(ox: Array, oy: Array, oz: Array, normal: Integers, boxes: Integers) -> Kinds:
    """(nx, ny, nz) kind of each cell; WIDE outside boxes of nodes (n, 3, 2), where all faces are
    open.

    normal  (3, 2) a of the velocity across the sides, see `fluid.sides.side`
    """
    n0, n1, n2 = oy.shape[0], ox.shape[1], ox.shape[2]
    kind = np.full((n0, n1, n2), WIDE, np.int8)
    first, last = through(normal, 2, 0, True), through(normal, 2, 1, True)
    for box in boxes:
        for i in range(box[0, 0], box[0, 1] - 1):
            below0 = through(normal, 0, 0, i == 0)
            above0 = through(normal, 0, 1, i == n0 - 1)
            for j in range(box[1, 0], box[1, 1] - 1):
                below1 = through(normal, 1, 0, j == 0)
                above1 = through(normal, 1, 1, j == n1 - 1)
                beside = below0 + above0 + below1 + above1 < 4.0
                for k in range(box[2, 0], box[2, 1] - 1):
                    widest = max(below0 * ox[i, j, k], above0 * ox[i + 1, j, k])
                    widest = max(widest, max(below1 * oy[i, j, k], above1 * oy[i, j + 1, k]))
                    at_side = beside
                    if n2 > 1:
                        below2 = first if k == 0 else 1.0
                        above2 = last if k == n2 - 1 else 1.0
                        widest = max(widest, max(below2 * oz[i, j, k], above2 * oz[i, j, k + 1]))
                        at_side = beside or below2 + above2 < 2.0
                    opened = WIDE if widest >= 0.5 else NARROW
                    shut = ENCLOSED if at_side else COVERED
                    kind[i, j, k] = opened if widest > 0.0 else shut
    return kind


@kernel
def cell_wrench(wrench: Array, i: int, j: int, k: int, piece: Piece) -> None:
    """Wrench of unit pressure in cell (i, j, k) on the body: what acts on a closed part of a face
    acts at its centre."""
    box, (origin, h, flat) = piece.box, piece.nodes
    (sx, sy, sz), (cx, cy, cz) = piece.share, piece.centre
    area = h if flat else h * h
    a, b, c = i - box[0, 0], j - box[1, 0], k - box[2, 0]
    x, y = origin[0] + h * (i + 0.5), origin[1] + h * (j + 0.5)
    z = 0.0 if flat else origin[2] + h * (k + 0.5)
    wrench[:] = 0.0
    for side in range(2):
        sign = 2.0 * side - 1.0
        f = sign * area * sx[a + side, b, c]
        wrench[0] += f
        wrench[4] += (z + h * cx[1, a + side, b, c]) * f
        wrench[5] -= (y + h * cx[0, a + side, b, c]) * f
        f = sign * area * sy[a, b + side, c]
        wrench[1] += f
        wrench[3] -= (z + h * cy[1, a, b + side, c]) * f
        wrench[5] += (x + h * cy[0, a, b + side, c]) * f
        if not flat:
            f = sign * area * sz[a, b, c + side]
            wrench[2] += f
            wrench[3] += (y + h * cz[1, a, b, c + side]) * f
            wrench[4] -= (x + h * cz[0, a, b, c + side]) * f


@kernel
def list_cells(piece: Piece, listed: Mask) -> tuple[Integers, Array]:
    """Listed cells (n,) with a coupling row of one body, flat, and (n, 6) its values, the wrench of
    unit pressure. Where the body closes as much on either side of a cell, at the same place, it has
    no row."""
    box, flat, (sx, sy, sz) = piece.box, piece.nodes.flat, piece.share
    n, at = listed.shape, 0
    most = 2 * int(np.count_nonzero(sx) + np.count_nonzero(sy) + np.count_nonzero(sz))
    wrench, cells, values = np.empty(6), np.empty(most, np.int64), np.empty((most, 6))
    for i in range(box[0, 0], box[0, 1] - 1):
        for j in range(box[1, 0], box[1, 1] - 1):
            for k in range(box[2, 0], box[2, 1] - 1):
                a, b, c = i - box[0, 0], j - box[1, 0], k - box[2, 0]
                closed = sx[a, b, c] + sx[a + 1, b, c] + sy[a, b, c] + sy[a, b + 1, c]
                if not flat:
                    closed += sz[a, b, c] + sz[a, b, c + 1]
                if closed == 0.0 or not listed[i, j, k]:
                    continue
                cell_wrench(wrench, i, j, k, piece)
                if wrench.any():
                    cells[at] = (i * n[1] + j) * n[2] + k
                    for m in range(6):
                        values[at, m] = wrench[m]
                    at += 1
    return cells[:at], values[:at]


@kernel
def flesh_rows(
    axis: Integers,
    at: Integers,
    closed: Array,
    corner: Integers,
    weight: Array,
    first_column: int,
    area: float,
    listed: Mask,
) -> tuple[Integers, Rows]:
    """Coupling rows of the cells beside closed parts of faces: one row per part and listed cell.

    axis, at        (n,), (n, 3) faces
    closed          (n,) part of each that flesh closes
    corner, weight  (n, 3) vertices that move it
    first_column    of the vertices' velocities
    listed          (nx, ny, nz) whether a cell has rows
    returns         number of the part of each row, and the rows
    """
    shape = listed.shape
    part, cells = np.empty(2 * axis.size, np.int64), np.empty(2 * axis.size, np.int64)
    columns = np.empty(6 * axis.size, np.int64)
    values = np.empty(6 * axis.size)
    cell = np.empty(3, np.int64)
    rows = 0
    for n in range(axis.size):
        for side in range(2):
            cell[:] = at[n]
            cell[axis[n]] -= 1 - side
            if cell[axis[n]] < 0 or cell[axis[n]] >= shape[axis[n]]:
                continue
            if not listed[cell[0], cell[1], cell[2]]:
                continue
            part[rows] = n
            cells[rows] = (cell[0] * shape[1] + cell[1]) * shape[2] + cell[2]
            for c in range(3):
                columns[3 * rows + c] = first_column + 3 * corner[n, c] + axis[n]
                values[3 * rows + c] = (1.0 - 2.0 * side) * area * closed[n] * weight[n, c]
            rows += 1
    start = 3 * np.arange(rows + 1)
    return part[:rows], (cells[:rows], start, columns[: 3 * rows], values[: 3 * rows])


Motion = tuple[Array, Array]
"""(nbody, 6) twist of the bodies, (n, 3) velocity of the vertices of flesh."""


@kernel
def add_body_velocity(out: Array, axis: int, parts: ClosedParts, motion: Motion) -> None:
    """Add closed part x body velocity on the faces across `axis`, at the centres of the parts."""
    twist, flesh = motion
    axes, faces, bodies, closed, place, corner, weight = parts
    flat_out = out.reshape(-1)
    rigid, one, other = axes.size - len(corner), (axis + 1) % 3, (axis + 2) % 3
    for n in range(axes.size):
        if axes[n] != axis:
            continue
        f = faces[n]
        if n >= rigid:
            velocity = 0.0
            for c in range(3):
                velocity += weight[n - rigid, c] * flesh[corner[n - rigid, c], axis]
            flat_out[f] += closed[n] * velocity
            continue
        t, p = twist[bodies[n]], place[n]
        velocity = t[axis] + t[3 + one] * p[other] - t[3 + other] * p[one]
        flat_out[f] += closed[n] * velocity


@kernel
def carried_at(
    faces: Integers, u: Array, axis: int, opened: Array, parts: ClosedParts, motion: Motion
) -> Array:
    """Open part x u + closed part x body velocity across `axis`, flat; on these faces alone."""
    field = np.empty(u.shape)
    found, flow, part = field.reshape(-1), u.reshape(-1), opened.reshape(-1)
    for f in faces:
        found[f] = part[f] * flow[f]
    add_body_velocity(field, axis, parts, motion)
    return found


@kernel
def fill_empty_faces(
    faces: Integers, u: Array, axis: int, held: Array, opened: Array, parts: ClosedParts,
    motion: Motion,
) -> None:  # fmt: skip
    """Give those of these faces of which `held` is 0 the value of `carried_at`, in place."""
    found = carried_at(faces, u, axis, opened, parts, motion)
    for f in faces:
        if held.reshape(-1)[f] == 0.0:
            u.reshape(-1)[f] = found[f]


@kernel
def fastest_closed(u: Array, axis: int, opened: Array, parts: ClosedParts, motion: Motion) -> float:
    """Largest size of `carried_at` on the faces across `axis` that bodies close in part."""
    faces, most = parts.face[parts.axis == axis], 0.0
    found = carried_at(faces, u, axis, opened, parts, motion)
    for f in faces:
        most = max(most, abs(found[f]))
    return most
