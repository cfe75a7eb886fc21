"""The grids of the multigrid hierarchy and their operators.

Every level is a weighted cell Laplacian like the finest,

    (K p)_c = sum over faces f of c of  w_f (p_c - p_neighbour)

held by its lower-face weights in arrays with one layer of ghost cells, all levels of one quantity
in one flat array. Ghost values of p are 0, which is what lies beyond an open side, or those of the
opposite side where the domain is periodic. A coarse cell covers two fine ones along each axis that
is coarsened, fewer at the upper end of an odd count; a coarse weight is the sum of the fine ones
that its face covers, times the ratio of the fine to the coarse distance between centres.

A slab (nx, ny, 1) is held as (1, nx, ny), the same order in memory, with no ghosts across it.
"""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Integers
from flowborne.kernels.levels import padded_size

COARSEST = 4
"""Most cells along an axis of the coarsest level."""


def level_table(shape: tuple[int, int, int]) -> Integers:
    """(levels + 1, 9) the hierarchy over a grid of `shape` cells; see OFFSET to GUESTS."""
    rows = []
    counts, size = list(shape), [1, 1, 1]
    offset = lean = 0
    while True:
        rows.append([offset, *counts, lean, *size, 0])
        offset += padded_size(counts[0], counts[1], counts[2])
        lean += sum(counts) + 6
        if max(counts) <= COARSEST:
            break
        for axis in range(3):
            if counts[axis] > 2:
                counts[axis] = (counts[axis] + 1) // 2
                size[axis] *= 2
    rows.append([offset, 0, 0, 0, lean, 0, 0, 0, 0])
    return np.array(rows, np.int64)
