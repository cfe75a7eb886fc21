"""Types of arrays, for kernels and all others, and their precision."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

ROUNDING = 1e-15
"""Relative size of what is a rounding error of numbers in double precision."""

LEAST = 1e-3
"""Part of a cell, of a face or of the distance between two that makes no difference near bodies. A
cell without as much is whole, as closed regions are scaled (see `coupling.leak_proof`); two sides
of it are as closed as each other; and friction does not grow where distances and volumes are
smaller."""

PRESCRIBED, PERIODIC, FREE = -1, 0, 1
"""a in u_ghost = a u_inside + b beyond a side: it gives the component of velocity on it, is the
opposite side, or leaves the component to the flow; see `fluid.sides.side`."""

Array = NDArray[np.float64]
Faces = tuple[Array, Array, Array]
"""One array per axis: u (nx+1, ny, nz), v (nx, ny+1, nz), w (nx, ny, nz+1)."""

Integers = NDArray[np.int64]
Mask = NDArray[np.bool_]
Real = NDArray[np.floating]
"""Double precision, or single in the preconditioner."""

Triple = tuple[Real, Real, Real]
"""One array per axis."""

Single = NDArray[np.float32]
Complex = NDArray[np.complex128]
Kinds = NDArray[np.int8]
Pixels = NDArray[np.uint8]

Mesh = tuple[Array, Integers]
"""Vertices (k, 3) and faces (m, 3), outward by the right-hand rule."""

Periodic = NDArray[np.uint8]
"""(3,) 1 for axes that are periodic."""

Marks = NDArray[np.uint8]
Indices = NDArray[np.int32]
Labels = NDArray[np.int32]

Hierarchy = tuple[Integers, Periodic, Triple, Real, Real, Marks, Real, Marks, Indices, Indices]
"""Table of levels; which axes are periodic; packed over the levels: weights across each axis, what
is added to the diagonal, the inverse of that, which rows are even (see `even`), interpolation
coefficients (see `levels.interpolation_weights`), marks, orphans and their aggregates (see
`aggregates`)."""

Finest = tuple[Array, Array, Array, Array]
"""Padded weights across each axis and diagonal of the finest level."""

Operator = tuple[Real, Real, Real, Real, Marks, int]
"""K on one level, padded: weights across each axis, the diagonal or its inverse, which rows are
even, and the cell whose weights these have (see `even`)."""

Vectors = tuple[Array, Array, Array, Array, Array]
"""Padded x, right-hand side, and three of scratch."""

Rows = tuple[Integers, Integers, Integers, Array]
"""Sparse rows J: flat cell of each, where each begins, columns and values of the entries."""

DenseTerm = tuple[Integers, Array, Array]
"""U diag(s) U^T: flat cells (n,), U^T (m, n) and s (m,)."""

Blocks = tuple[Integers, Integers, Indices, Integers, Indices]
"""Columns of a sparse L in blocks with the same rows: the first column of each (s+1,), where its
rows below begin (s+1,), those rows, where its values begin (s+1,), and the block of each column."""

MobilityArrays = tuple[Array, Indices, Indices, Array, Array, Blocks, Integers, Array]
"""Dense A^-1; rows of T (start, column, value); values of L and its blocks; the order P; Y (see
`solvers.mobility`)."""


class Nodes(NamedTuple):
    """Where the nodes of the grid are: (i, j, k) at origin + spacing (i, j, k).

    origin   (3,) m
    spacing  m
    flat     whether it is a slab, whose nodes lie at z = 0
    """

    origin: Array
    spacing: float
    flat: bool


Three = tuple[int, int, int]
"""One number per axis: arrays would have their references counted for every place of a list."""


class FaceGrid(NamedTuple):
    """The faces across one axis, and their control volumes, in the order of the kernels' axes.

    component  that axis
    shape      of fields on them
    wraps      how many distinct ones there are along each periodic axis, else 0
    """

    component: int
    shape: Three
    wraps: Three


Point = tuple[float, float, float]
"""In kernels; a row of an array serves as well."""
