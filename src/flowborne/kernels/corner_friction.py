"""Friction at convex corners of bodies in a slab, and along their edges in a room.

Past a corner the flow leaves a narrow row of faces, and for a cell or so its profile stays: it is
fast in what the row before left open and slow behind the end of the body. One velocity for each
face has neither, and friction within a cell of a corner then depends by half on its place there.

So a line of faces more goes across the row through the corner. With the flux Q on it, and d by how
much the open row beyond it is faster beside the corner than behind, each of the integrals over
mu (du/dx)^2 and mu (du/dy)^2 within half a cell of the line is written anew; Q and d are those of
least dissipation. That is a quadratic form of the five velocities around the corner, so that the
matrix stays symmetric and positive definite; it changes little as a corner passes from cell to
cell. Along an edge in a room it holds in the plane across the axis that the edge goes along.
"""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import LEAST, Array, Integers
from flowborne.kernels.cut_faces import (
    closed_face,
    crossings_on,
    edges_of,
    is_cut,
    other_axes,
    values_at,
)
from flowborne.kernels.edge_crossings import Crossings
from flowborne.kernels.jit import inlined, kernel
from flowborne.kernels.viscosity import UNKNOWN, CutFaces, nearest_node

SHARP = np.cos(np.radians(20.0))
"""Cosine of the least turn of a wall at a corner: round bodies are polygons that turn by less."""

NARROW, BESIDE, BEYOND, NEXT, BEHIND, FLUX, SHEAR = range(7)
"""The faces around a corner: in its row before and beyond the line, beside each of these on the
open side, and behind the end of the body; Q and d."""

AROUND = FLUX
"""How many faces."""


@kernel
def corner_on(
    distance: Array, found: Crossings, axis: int, i: int, j: int, k: int, corner: Array,
    scratch: Integers,
) -> bool:  # fmt: skip
    """Whether one sharp convex corner is on face (i, j, k) across `axis`.

    corner   (3, 2) its place from the face's lower corner, cells, and normals of the two walls,
             along the two other axes; overwritten
    scratch  (8,)
    """
    if not is_cut(distance, found, axis, i, j, k):
        return False
    flat = distance.shape[2] == 2
    closed, _, _, kinks, x, y = closed_face(distance, found, axis, i, j, k, flat, False)
    edges = edges_of(axis, i, j, k, found)
    if kinks != 1 or crossings_on(values_at(distance, axis, i, j, k), edges, scratch) != 2:
        return False
    corner[0] = x, y
    s, t = other_axes(axis)
    for n in range(2):
        normal = found.normal[scratch[n]]
        corner[1 + n] = normal[s], normal[t]
        corner[1 + n] /= np.sqrt((corner[1 + n] ** 2).sum())
    if corner[1] @ corner[2] > SHARP:
        return False
    return closed > closed_face(distance, found, axis, i, j, k, flat, True)[0]


@kernel
def find_corners(distance: Array, found: Crossings, h: float) -> tuple[Integers, Array]:
    """Cells of size h that one sharp convex edge of a body passes from one face to that opposite.

    returns  (n, 4) the cells, and the axis across these faces; (n, 3, 2) the mean of `corner_on`
    """
    flat = distance.shape[2] == 2
    most, count, scratch = 3 * found.part.size, 0, np.empty(8, np.int64)
    cells, corner = np.empty((most, 4), np.int64), np.empty((most, 3, 2))
    low, high = np.empty((3, 2)), np.empty((3, 2))
    for i in range(distance.shape[0] - 1):
        for j in range(distance.shape[1] - 1):
            for k in range(distance.shape[2] - 1):
                if abs(distance[i, j, k]) > 2.0 * h:
                    continue
                for axis in range(2 if flat else 0, 3):
                    if not corner_on(distance, found, axis, i, j, k, low, scratch):
                        continue
                    if flat:
                        high[:] = low
                    elif not corner_on(
                        distance, found, axis,
                        i + int(axis == 0), j + int(axis == 1), k + int(axis == 2), high, scratch,
                    ):  # fmt: skip
                        continue
                    same = low[1] @ high[1] + low[2] @ high[2] > low[1] @ high[2] + low[2] @ high[1]
                    first = high[1 if same else 2]
                    second = high[2 if same else 1]
                    if low[1] @ first <= 0.0 or low[2] @ second <= 0.0:
                        continue  # the edges of two walls that look opposite ways
                    cells[count, 0], cells[count, 1], cells[count, 2] = i, j, k
                    cells[count, 3] = axis
                    corner[count, 0] = 0.5 * (low[0] + high[0])
                    corner[count, 1] = 0.5 * (low[1] + first)
                    corner[count, 2] = 0.5 * (low[2] + second)
                    count += 1
    return cells[:count], corner[:count]


@inlined
def add_square(form: Array, weight: float, terms: tuple[tuple[int, float], ...]) -> None:
    """Add weight (sum of factors times velocities)^2 to a quadratic form, in place.

    terms  velocities and their factors
    """
    for i, x in terms:
        for j, y in terms:
            form[i, j] += weight * x * y


@kernel
def eliminate(form: Array, last: int) -> None:
    """Give the last velocity the value for which a quadratic form is least, in place."""
    if form[last, last] > 0.0:
        for i in range(last):
            for j in range(last):
                form[i, j] -= form[i, last] * form[last, j] / form[last, last]


@kernel
def corner_form(
    narrow: float, beyond: float, volume: float, b: float, h: float, stays: bool,
    links: tuple[float, float, float], walls: tuple[float, float],
) -> Array:  # fmt: skip
    """(7, 7) what a corner adds to the quadratic form u K u, in cells and mu h; the last two rows
    are eliminated.

    narrow, beyond  open parts of the faces before and beyond the line
    volume          that of the cell between them
    b, h            the line's distance from the face before, and its open part
    stays           whether the wall behind the corner stays in the row up to the face beyond, or
                    goes across the row
    links           between the faces NARROW and BESIDE, BEYOND and NEXT, BEYOND and BEHIND
    walls           W in the plane of the faces NARROW and BEYOND
    """
    form, rest = np.zeros((7, 7)), 1.0 - h
    before, width = min(0.5 * b * (narrow + h), volume), 0.0 if stays else b * (1.0 - 0.5 * b)
    # off: the cell, and what of the faces' own widths is beyond and before the line
    add_square(form, -1.0 / volume, ((NARROW, -narrow), (BEYOND, beyond)))
    lost = 0.5 - 0.5 * b
    add_square(form, -lost * links[0], ((NARROW, 1.0), (BESIDE, -1.0)))
    form[NARROW, NARROW] -= lost * walls[0]
    lost = 0.5 * b + width
    add_square(form, -lost * links[1], ((BEYOND, 1.0), (NEXT, -1.0)))
    add_square(form, -lost * links[2], ((BEYOND, 1.0), (BEHIND, -1.0)))
    form[BEYOND, BEYOND] -= lost * walls[1]
    # on: up to the line, and along it
    add_square(form, 1.0 / max(before, LEAST), ((NARROW, -narrow), (FLUX, 1.0)))
    add_square(form, 1.0 / (1.0 + h), ((BESIDE, b - 1.0), (NEXT, -b), (FLUX, 1.0 / h)))
    form[FLUX, FLUX] += (b / h + (1.0 - b) * (1.0 / h if stays else 1.0)) / h**2
    # and from there to the face beyond: with the wall, or in what is open and what it closed
    if stays:
        add_square(form, 1.0 / max(volume - before, LEAST), ((BEYOND, beyond), (FLUX, -1.0)))
    else:
        on, off = (BEYOND, h), (BEYOND, rest)
        part = h * (1.0 - b)
        add_square(form, 1.0 / part, (on, (SHEAR, h * rest), (FLUX, -1.0)))
        add_square(form, 1.0 / max(volume - before - part, LEAST), (off, (SHEAR, -h * rest)))
        upper = (NEXT, 1.0), (BEYOND, -1.0), (SHEAR, -rest)
        add_square(form, width / (0.5 + 0.5 * h), upper)
        form[SHEAR, SHEAR] += 2.0 * width
        lower = (BEYOND, 1.0), (SHEAR, -h), (BEHIND, -1.0)
        add_square(form, width / (0.5 + 0.5 * rest), lower)
        add_square(form, h * rest / b, ((SHEAR, 1.0), (NEXT, -0.25), (BEHIND, 0.25)))
    eliminate(form, SHEAR)
    eliminate(form, FLUX)
    return form


@inlined
def face_at(shape: tuple[int, int, int], at: Integers, wraps: Integers) -> int:
    """Flat index of the face at (i, j, k) of some with this shape; -1 beyond the domain.

    wraps  (3,) number of distinct faces along each axis where the domain is periodic, else 0
    """
    flat = 0
    for d in range(3):
        n = at[d] % wraps[d] if wraps[d] > 0 else at[d]
        if n < 0 or n >= shape[d]:
            return -1
        flat = flat * shape[d] + n
    return flat


@inlined
def link_between(link: Array, f: int, g: int, stride: int) -> float:
    """k between two faces `stride` apart or at opposite periodic sides; 0 of one that is not there.

    link  k from each to the next
    """
    if min(f, g) < 0:
        return 0.0
    return link[min(f, g)] if abs(g - f) == stride else link[max(f, g)]


@inlined
def wall_at(beside: Integers, wall: Array, f: int) -> float:
    """W in the plane of face f; 0 of one that is not beside a body."""
    n = np.searchsorted(beside, f)
    return wall[n] if n < beside.size and beside[n] == f else 0.0


@kernel
def corner_stiffness(
    known: CutFaces, cells: Integers, corner: Array, links: Array, beside: Integers, wall: Array,
    wraps: Integers,
) -> tuple[Integers, Array, Integers]:  # fmt: skip
    """What corners add to the matrix of faces, those at which all faces around are unknown, and one
    wall is more along the axis and the other more across.

    cells, corner  see `find_corners`
    links          (3, ...) k to the next face along each axis, kg/s
    beside, wall   flat indices of the faces beside bodies, and W in their plane, kg/s
    wraps          see `face_at`
    returns        (n, AROUND) flat indices of the faces around; (n, AROUND, AROUND) kg/s; (n,) flat
                   index of the node of the cell nearest to a body
    """
    axis, kind, distance, _, opened, _, parts, stiffness = known
    faces, node = np.empty((len(cells), AROUND), np.int64), np.empty(len(cells), np.int64)
    matrix = np.zeros((len(cells), AROUND, AROUND))
    count, own, at = 0, np.empty(AROUND, np.int64), np.empty(3, np.int64)
    kinds, open_parts = kind.reshape(-1), opened.reshape(-1)
    _, nj, nk = kind.shape
    for c in range(len(cells)):
        if cells[c, 3] == axis:
            continue
        d = 3 - axis - cells[c, 3]
        s, t = int(axis > d), int(axis < d)
        side, end = corner[c, 1], corner[c, 2]
        if abs(side[s]) > abs(side[t]):
            side, end = end, side
        if abs(side[s]) >= abs(side[t]) or abs(end[s]) <= abs(end[t]):
            continue
        upward, onward = int(np.sign(side[t])), int(np.sign(end[s]))
        for f in range(AROUND):
            at[:] = cells[c, :3]
            at[axis] += int(onward < 0) + onward * int(f in (BEYOND, NEXT, BEHIND))
            at[d] += upward * (int(f in (BESIDE, NEXT)) - int(f == BEHIND))
            own[f] = face_at(kind.shape, at, wraps)
            if own[f] >= 0 and kinds[own[f]] != UNKNOWN:
                own[f] = -1
        if own[:BEHIND].min() < 0:
            continue
        b = min(max(0.5 + onward * (corner[c, 0, s] - 0.5), LEAST), 1.0 - LEAST)
        h = min(max(0.5 - upward * (corner[c, 0, t] - 0.5), LEAST), 1.0 - LEAST)
        narrow, beyond = open_parts[own[NARROW]], open_parts[own[BEYOND]]
        volume = max(parts[cells[c, 0], cells[c, 1], cells[c, 2]], LEAST * max(narrow, beyond))
        link, stride = links[d].reshape(-1), (nj * nk, nk, 1)[d]
        between = (
            link_between(link, own[NARROW], own[BESIDE], stride) / stiffness,
            link_between(link, own[BEYOND], own[NEXT], stride) / stiffness,
            link_between(link, own[BEYOND], own[BEHIND], stride) / stiffness,
        )
        walls = (
            wall_at(beside, wall, own[NARROW]) / stiffness,
            wall_at(beside, wall, own[BEYOND]) / stiffness,
        )
        stays = min(max(upward * end[t] / abs(end[s]) * (1.0 - h) / (1.0 - b), 0.0), 1.0)
        if beyond < 1.0 or own[BEHIND] < 0:
            stays = 1.0
        for in_row, share in ((False, 1.0 - stays), (True, stays)):
            if share > 0.0:
                form = corner_form(narrow, beyond, volume, b, h, in_row, between, walls)
                matrix[count] += share * stiffness * form[:AROUND, :AROUND]
        if own[BEHIND] < 0:
            own[BEHIND] = own[BEYOND]  # to which nothing is added
        node[count] = nearest_node(distance, cells[c, 0], cells[c, 1], cells[c, 2], 1, 1, 1)
        faces[count] = own
        count += 1
    return faces[:count], matrix[:count], node[:count]
