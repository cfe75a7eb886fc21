"""Arrays of a multigrid hierarchy, and their filling from face weights (see `kernels.levels`).

Arrays are large and the same for every system of one grid, so those that a system has done with are
kept for the next one.
"""

from __future__ import annotations

import weakref

import numpy as np

from flowborne.kernels.aggregates import OWN
from flowborne.kernels.arrays import (
    Array,
    Finest,
    Hierarchy,
    Indices,
    Integers,
    Labels,
    Marks,
    Operator,
    Periodic,
    Real,
    Vectors,
)
from flowborne.kernels.levels import INTERPOLATION, ROW, even_at, fill_levels, padded_size
from flowborne.kernels.regions import label_regions

COARSEST = 4
"""Most cells along an axis of the coarsest level."""


def level_table(shape: tuple[int, int, int]) -> Integers:
    """(levels + 1, 11) hierarchy over a grid of `shape` cells; see `levels.OFFSET` to `COMMON`."""
    levels = []
    counts, size = list(shape), [1, 1, 1]
    offset = interpolation = rows = 0
    while True:
        cells = padded_size(counts[0], counts[1], counts[2])
        levels.append([offset, *counts, interpolation, *size, 0, rows, 0])
        offset += cells
        rows += cells // (counts[2] + 2)
        interpolation += sum(counts) + 6
        if max(counts) <= COARSEST:
            break
        for axis in range(3):
            if counts[axis] > 2:
                counts[axis] = (counts[axis] + 1) // 2
                size[axis] *= 2
    levels.append([offset, 0, 0, 0, interpolation, 0, 0, 0, 0, rows, 0])
    return np.array(levels, np.int64)


def packed(size: int) -> Real:
    return np.zeros(size, np.float32)


class Buffers:
    """Arrays of one hierarchy and of one solve, kept for the next system of the same kind.

    shape     cells
    periodic  of each axis: with the shape it decides the ghosts that buffers are left with
    """

    def __init__(self, shape: tuple[int, int, int], periodic: tuple[bool, bool, bool]) -> None:
        self.table = level_table(shape)
        self.periodic: Periodic = np.array(periodic, np.uint8)
        total = int(self.table[-1, 0])
        n0, n1, n2 = shape
        padded = (n0 + 2 if n0 > 1 else 1, n1 + 2, n2 + 2)
        double = [np.zeros(padded) for _ in range(9)]
        self.finest: Finest = double[0], double[1], double[2], double[3]
        self.vectors: Vectors = double[4], double[5], double[6], double[7], double[8]
        self.weights = packed(total), packed(total), packed(total)
        self.reaction = packed(total)
        self.inverse = packed(total)
        self.even: Marks = np.zeros(int(self.table[-1, ROW]), np.uint8)
        self.interpolation = packed(int(self.table[-1, INTERPOLATION]))
        self.marks: Marks = np.full(total, OWN, np.uint8)
        self.orphans: Indices = np.zeros(total, np.int32)
        self.aggregates: Indices = np.zeros(total, np.int32)
        of_faces = self.weights, self.reaction, self.inverse, self.even, self.interpolation
        of_cells = self.marks, self.orphans, self.aggregates
        self.hierarchy: Hierarchy = (self.table, self.periodic, *of_faces, *of_cells)
        self.cycle = packed(total), packed(total), packed(total)
        self.label: Labels = np.zeros(padded, np.int32)
        self.parent: Labels = np.zeros(self.label.size + 1, np.int32)
        self.count: Labels = np.zeros(self.label.size + 1, np.int32)

    def prepare(
        self, faces: tuple[Array, Array, Array], reaction: Array
    ) -> tuple[int, float, Operator]:
        """Fill finest level, hierarchy and region labels from the weights on the faces.

        reaction  (cells) of K + D, which the hierarchy is made for; see `pressure.PressureSystem`
        returns   number of regions without an open side, scale of the hierarchy's weights, and K on
                  the finest level
        """
        scale, common = fill_levels(self.hierarchy, faces, reaction, self.finest)
        even, labels = even_at(self.even, self.table, 0), (self.label, self.parent, self.count)
        regions = label_regions(self.finest, even, self.periodic, *labels)
        return regions, scale, (*self.finest, even, int(common))


_spare: dict[tuple[tuple[int, int, int], tuple[bool, bool, bool]], list[Buffers]] = {}


def borrow(
    shape: tuple[int, int, int], periodic: tuple[bool, bool, bool], owner: object
) -> Buffers:
    """Buffers that go back into store when `owner` is gone."""
    store = _spare.setdefault((shape, periodic), [])
    try:
        buffers = store.pop()
    except IndexError:
        buffers = Buffers(shape, periodic)
    weakref.finalize(owner, store.append, buffers)
    return buffers
