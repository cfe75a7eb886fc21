"""Divergence and gradient on cut cells: the two sides of the pressure equation.

With face areas A, open fractions a and p^ = p dt,

    net outflow of a cell   D u  = sum over its faces of a A (u . outward)
    velocity change         u   -= (1/rho) (p^_upper - p^_lower) / h
    weights of the matrix   w    = a A / (rho h)        (doubled at an open side, half a cell away)

so that momentum taken from a face, a rho V du, is what its two cells push with.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.ghosts import edge
from flowborne.fluid.grid import Array, Faces, Grid
from flowborne.kernels.pressure_gradient import push_faces
from flowborne.kernels.sides import CLOSED, OPEN, PERIODIC


def side_codes(boundaries: Boundaries) -> NDArray[np.int64]:
    """(3, 2) CLOSED, OPEN or PERIODIC for the lower and upper side of each axis."""
    code = {"open": OPEN, "periodic": PERIODIC}
    return np.array(
        [[code.get(side.kind, CLOSED) for side in boundaries.pair(axis)] for axis in range(3)]
    )


def face_weights(opened: Faces, grid: Grid, boundaries: Boundaries, density: float) -> Faces:
    """Weights w of the pressure matrix, m^4/kg times area over spacing; see the module."""
    scale = grid.face_area / (density * grid.spacing)
    weights = [scale * values for values in opened]
    codes = side_codes(boundaries)
    for axis in range(3):
        for end, layer in ((0, 0), (1, -1)):
            if codes[axis, end] == CLOSED:
                weights[axis][edge(axis, layer)] = 0.0
            elif codes[axis, end] == OPEN:
                weights[axis][edge(axis, layer)] *= 2.0
    return weights[0], weights[1], weights[2]


def push(
    velocity: Faces,
    opened: Faces,
    pressure: Array,
    grid: Grid,
    boundaries: Boundaries,
    scale: float,
) -> None:
    """Subtract scale (p_upper - p_lower) on every face, in place; see `push_faces`."""
    codes = side_codes(boundaries)
    for axis in grid.axes:
        push_faces(velocity[axis], opened[axis], pressure, axis, scale, codes)
