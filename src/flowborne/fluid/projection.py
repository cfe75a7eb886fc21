"""Divergence and gradient on cut cells: the two sides of the pressure equation.

With face areas A, open fractions a and p^ = p dt,

    net outflow of a cell   D u  = sum over its faces of a A (u . outward)
    velocity change         u   -= a A (p^_upper - p^_lower) / m
    weights of the matrix   w    = (a A)^2 / m

for the mass m of the fluid that belongs to a face, so that the momentum taken from it, m du, is
what its two cells push with.
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


def face_weights(opened: Faces, mass: Faces, grid: Grid, boundaries: Boundaries) -> Faces:
    """Weights w = (a A)^2 / m of the pressure matrix; see the module.

    mass  of each face, kg; 0 where no pressure acts
    """
    weights = []
    codes = side_codes(boundaries)
    for axis in range(3):
        area = grid.face_area * opened[axis]
        weight = np.divide(
            area * area, mass[axis], out=np.zeros(area.shape), where=mass[axis] > 0.0
        )
        for end, layer in ((0, 0), (1, -1)):
            if codes[axis, end] == CLOSED:
                weight[edge(axis, layer)] = 0.0
        weights.append(weight)
    return weights[0], weights[1], weights[2]


def accelerated(opened: Faces, mass: Faces, grid: Grid) -> Faces:
    """a A / m of each face: what a difference of pressures accelerates it by, 1/(kg/m^2)."""
    rates = []
    for axis in range(3):
        area = grid.face_area * opened[axis]
        rates.append(np.divide(area, mass[axis], out=np.zeros(area.shape), where=mass[axis] > 0.0))
    return rates[0], rates[1], rates[2]


def push(
    velocity: Faces,
    rate: Faces,
    pressure: Array,
    grid: Grid,
    boundaries: Boundaries,
    scale: float,
) -> None:
    """Subtract scale rate (p_upper - p_lower) on every face, in place; see `push_faces`."""
    codes = side_codes(boundaries)
    for axis in grid.axes:
        push_faces(velocity[axis], rate[axis], pressure, axis, scale, codes)
