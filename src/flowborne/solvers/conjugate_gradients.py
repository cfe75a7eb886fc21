"""Conjugate gradients on an operator that is given as a function.

For the pressure, with its preconditioner, all of it is one kernel (`kernels.conjugate_gradients`).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from flowborne.kernels.arrays import ROUNDING, Array
from flowborne.kernels.vectors import descend, dot, turn

WIDTH = 256
"""Entries in a row of the vectors."""


def spread(size: int) -> Array:
    """Zeros for a flat vector of a size in rows of WIDTH, and what fills up the last one: what
    threads share out."""
    return np.zeros((-(-size // WIDTH), 1, WIDTH))


def conjugate_gradients(
    apply: Callable[[Array], Array],
    right: Array,
    x: Array,
    tolerance: float,
    most: int,
    precondition: Callable[[Array], Array] | None = None,
) -> bool:
    """Solve apply(x) = right from the guess in x, in place; returns whether the residual asked for
    was reached.

    apply      a symmetric positive definite matrix with a diagonal of 1 on a vector
    right, x   vectors as `spread` gives them
    tolerance  relative residual
    most       iterations
    precondition  close to the inverse of the matrix, symmetric positive definite
    """
    residual = right - apply(x)
    direction = np.zeros_like(x)
    goal = max(tolerance**2 * dot(right, right), ROUNDING**2 * dot(x, x))
    square, before, iterations = dot(residual, residual), np.inf, 0
    while square > goal and iterations < most:
        guided = residual if precondition is None else precondition(residual)
        product = square if precondition is None else dot(residual, guided)
        turn(direction, guided, product / before)
        image = apply(direction)
        square = descend(x, residual, direction, image, product / dot(direction, image))
        before, iterations = product, iterations + 1
    return bool(square <= goal)
