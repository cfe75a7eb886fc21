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
from flowborne.fluid.grid import Array, Faces, Grid, faces_of
from flowborne.kernels.faces import accelerate, weigh
from flowborne.kernels.pressure_gradient import subtract_gradient


def accelerated(opened: Faces, mass: Faces, grid: Grid, boundaries: Boundaries) -> Faces:
    """a A / m of each face: what a difference of pressures accelerates it by, 1/(kg/m^2); on the
    sides of the domain the part of it that they leave to the pressure.

    mass  of each face, kg; 0 where no pressure acts
    """
    rates = faces_of([np.empty(o.shape) for o in opened])
    for rate, part, m in zip(rates, opened, mass, strict=True):
        accelerate(rate, part, m, grid.face_area)
    for place, side in boundaries.around(grid):
        rates[place.axis][place.layer] *= side.pressure_weight(place)
    return rates


def accelerating_cells(rate: Faces) -> NDArray[np.bool_]:
    """Which cells (nx, ny, nz) have a face that their pressure accelerates, see `accelerated`."""
    below, above = edge(0, slice(None, -1)), edge(0, slice(1, None))
    found = (rate[0][below] > 0.0) | (rate[0][above] > 0.0)
    for axis in (1, 2):
        for part in (edge(axis, slice(None, -1)), edge(axis, slice(1, None))):
            found |= rate[axis][part] > 0.0
    return found


def face_weights(opened: Faces, rate: Faces, grid: Grid) -> Faces:
    """Weights w = a A rate of the pressure matrix, of a A / m; see the module."""
    weights = faces_of([np.empty(o.shape) for o in opened])
    for axis in range(3):
        weigh(weights[axis], opened[axis], rate[axis], grid.face_area)
    return weights


def subtract_pressure_gradient(
    velocity: Faces,
    rate: Faces,
    pressure: Array,
    grid: Grid,
    boundaries: Boundaries,
    scale: float,
) -> None:
    """Subtract scale rate (p_upper - p_lower) on every face, in place; see `subtract_gradient`."""
    codes = boundaries.codes()
    for axis in grid.axes:
        subtract_gradient(velocity[axis], rate[axis], pressure, axis, scale, codes)
