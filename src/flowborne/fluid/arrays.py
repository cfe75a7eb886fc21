"""Types of the arrays that kernels take."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Integers = NDArray[np.int64]
Real = NDArray[np.floating]
"""Double precision, or single in the preconditioner."""

Triple = tuple[Real, Real, Real]
"""One array per axis."""

Periodic = NDArray[np.uint8]
"""(3,) 1 for axes that are periodic."""

Marks = NDArray[np.uint8]
Places = NDArray[np.int32]
Labels = NDArray[np.int32]

Hierarchy = tuple[Integers, Periodic, Triple, Real, Real, Real, Marks, Places, Places]
"""Table of levels; which axes are periodic; packed over the levels: weights across each axis, what
is added to the diagonal, the inverse of that, interpolation coefficients (see `levels.leaning`),
marks, guests and their hosts (see `aggregates`)."""

Rows = tuple[Integers, Integers, Integers, NDArray[np.float64]]
"""Rows of G^T: padded flat cell of each, where each begins, columns and values of the entries."""
