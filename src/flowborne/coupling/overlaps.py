"""Pressure in cells that bodies cover together, where they overlap.

A uniform pressure does no work on a body with a closed surface: the area vectors of its closed
parts, each counted in the cells on both sides of its face, add up to nothing, and so do their
moments. Inside an overlap two bodies share the faces in amounts that change from face to face, but
there is no pressure in a cell without an open face. With its rows of J left out, a uniform pressure
turns the joint between both bodies: T^T J^T 1 is 0.05 to 0.2 h^2 per radian at a hinge of the eel.
Beside an open side the pressure has no uniform part that a bend could raise, and they are left out,
as in the paper: covered surfaces feel nothing. In a domain without one the fluid keeps its volume,
and that would hold the joint fast.

There the pressure of a covered cell is that of the fluid around: the mean of those neighbours that
are one cell nearer to it, and thus a weighted mean p = E p of open cells, with E 1 = 1. The rows of
J become those of E^T J. Both bodies are pushed with opposite forces at one place, which changes no
momentum. The cells that lend their pressure have a face that is open by half at least: what they
make room for leaves them through it, and would be shot out of a crack.

Bodies that overlap displace the volume of their union, and a bend may change their common volume.
Round ends about a hinge keep it. Otherwise the fluid does not feel the change as pressure; the
volumes of the cells take it up (see `leak_proof`).
"""

from __future__ import annotations

import numpy as np

from flowborne.fluid.ghosts import edge
from flowborne.kernels.arrays import Integers, Kinds, Rows
from flowborne.kernels.coupling_rows import COVERED, NARROW, WIDE


def handed_on(rows: Rows, kind: Kinds, columns: int, periodic: tuple[bool, bool, bool]) -> Rows:
    """E^T J: the rows of COVERED cells as rows of WIDE ones, one for each cell.

    kind     (nx, ny, nz) of the cells, see `kinds_of_cells`
    columns  k of J
    periodic (3,) whether each axis is: there the way goes on from one side to the other
    Cells from which no way leads through covered and narrow ones to a wide one have no rows.
    """
    padded = np.pad(kind, 1)
    home: Integers = np.arange(padded.size).reshape(padded.shape)
    for axis in (axis for axis in range(3) if periodic[axis]):
        home[edge(axis, 0)], home[edge(axis, -1)] = home[edge(axis, -2)], home[edge(axis, 1)]
    strides = np.array(padded.strides) // padded.itemsize
    steps = np.concatenate([strides, -strides])
    sources, start, column, value = rows
    inside = np.stack(np.unravel_index(sources, kind.shape)) + 1
    cell = np.repeat(np.ravel_multi_index(tuple(inside), padded.shape), np.diff(start))
    layer = layers(padded.ravel(), np.unique(cell), steps, home.ravel())
    kept = layer[cell] > 0
    cell, column, value = cell[kept], column[kept], value[kept]
    for depth in range(int(layer[cell].max(initial=0)), 0, -1):
        deep = layer[cell] == depth
        beside = home.ravel()[cell[deep, None] + steps]
        nearer = layer[beside] == depth - 1
        number = nearer.sum(axis=1)
        cell = np.concatenate([cell[~deep], beside[nearer]])
        column = np.concatenate([column[~deep], np.repeat(column[deep], number)])
        value = np.concatenate([value[~deep], np.repeat(value[deep] / number, number)])
        entry, same = np.unique(columns * cell + column, return_inverse=True)
        cell, column = entry // columns, entry % columns
        value = np.asarray(np.bincount(same, value, entry.size), np.float64)
    found, first = np.unique(cell, return_index=True)
    outside = np.stack(np.unravel_index(found, padded.shape)) - 1
    cells = np.ravel_multi_index(tuple(outside), kind.shape)
    return cells, np.append(first, cell.size), column, value


def layers(kind: Kinds, sources: Integers, steps: Integers, home: Integers) -> Integers:
    """(n,) how many steps from cell to cell, none of which is ENCLOSED, lead to a WIDE one, as far
    as the sources are deep; -1 for cells beyond them and those that no way leads out of.

    kind     (n,) of all cells, with a rim of others
    sources  (m,) COVERED cells
    steps    (6,) from the index of a cell to those of its neighbours
    home     (n,) the cell that each is, one across the domain for the rim of a periodic side
    """
    layer = np.where(kind == WIDE, 0, -1)
    left = np.flatnonzero((kind == COVERED) | (kind == NARROW))
    depth = 0
    while (layer[sources] < 0).any():
        reached = (layer[home[left[:, None] + steps]] == depth).any(axis=1)
        if not reached.any():
            break
        depth += 1
        layer[left[reached]] = depth
        left = left[~reached]
    return layer
