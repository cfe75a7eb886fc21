"""The kernels of `coupling_rows` in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import PRESCRIBED, Array, Faces, Integers, Kinds, Mask, Rows
from flowborne.kernels.closed_fractions import Piece
from flowborne.kernels.coupling_rows import COVERED, ENCLOSED, NARROW, WIDE


def kinds_of_cells_reference(opened: Faces, normal: Integers) -> Kinds:
    """`kinds_of_cells` in NumPy."""
    slab = opened[0].shape[2] == 1
    shape = opened[1].shape[0], *opened[0].shape[1:]
    kind, widest = np.full(shape, COVERED, np.int8), np.zeros(shape)
    for axis in range(2 if slab else 3):
        passes, layers = np.moveaxis(opened[axis].copy(), axis, 0), np.moveaxis(kind, axis, 0)
        for end in (0, -1):
            if normal[axis, end] == PRESCRIBED:
                passes[end], layers[end] = 0.0, ENCLOSED
        wider = np.moveaxis(np.maximum(passes[:-1], passes[1:]), 0, axis)
        widest = np.maximum(widest, wider)
    kind[widest > 0.0] = NARROW
    kind[widest >= 0.5] = WIDE
    return kind


def list_cells_reference(piece: Piece, listed: Mask) -> tuple[Integers, Array]:
    """`list_cells` in NumPy: cells (n,) and values (n, 6)."""
    box, (origin, h, flat), share, centre = piece.box, piece.nodes, piece.share, piece.centre
    inside = tuple(slice(low, high - 1) for low, high in box)
    area = h if flat else h**2
    cell = np.moveaxis(np.indices(listed.shape)[(slice(None), *inside)], 0, -1)
    wrench = np.zeros((*cell.shape[:3], 6))
    for axis in range(2 if flat else 3):
        for side in range(2):
            ends = slice(side, None if side else -1)
            faces = tuple(ends if d == axis else slice(None) for d in range(3))
            place = cell + 0.5
            place[..., np.arange(3) != axis] += np.moveaxis(centre[axis][:, *faces], 0, -1)
            place = origin + h * place
            if flat:
                place[..., 2] = 0.0
            force = np.zeros(cell.shape)
            force[..., axis] = (2 * side - 1) * area * share[axis][faces]
            wrench += np.concatenate([force, np.cross(place, force)], axis=3)
    found = listed[inside] & wrench.any(axis=3)
    place = np.stack(np.nonzero(found), axis=1) + box[:, 0]
    values = wrench[found]
    cells = np.ravel_multi_index(tuple(place.T), listed.shape)
    return cells, values


def flesh_rows_reference(
    axis: Integers,
    at: Integers,
    closed: Array,
    corner: Integers,
    weight: Array,
    first_column: int,
    area: float,
    listed: Mask,
) -> tuple[Integers, Rows]:
    """`flesh_rows` in NumPy."""
    shape = np.array(listed.shape)
    part, side = np.divmod(np.arange(2 * axis.size), 2)
    cell = at[part] - (1 - side)[:, None] * np.eye(3, dtype=np.int64)[axis[part]]
    inside = np.all((cell >= 0) & (cell < shape), axis=1)
    inside[inside] = listed[tuple(cell[inside].T)]
    part, side, cell = part[inside], side[inside], cell[inside]
    columns = first_column + 3 * corner[part] + axis[part][:, None]
    values = ((1.0 - 2.0 * side) * area * closed[part])[:, None] * weight[part]
    cells = np.ravel_multi_index(tuple(cell.T), tuple(shape))
    return part, (cells, 3 * np.arange(part.size + 1), columns.ravel(), values.ravel())
