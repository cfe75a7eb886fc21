"""Fields in the middle of cells, of a state as a run writes it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from flowborne.fluid.grid import Grid

Array = NDArray[np.float64]
Arrays = Mapping[str, NDArray[np.floating]]


def cell_velocity(grid: Grid, state: Arrays) -> NDArray[np.float32]:
    """(nx, ny, nz, 3) mean of the faces, m/s; no z in a slab."""
    found = np.zeros((*grid.shape, 3), np.float32)
    for axis in grid.axes:
        faces = np.moveaxis(state[f"velocity_{'xyz'[axis]}"], axis, 0)
        found[..., axis] = np.moveaxis(0.5 * (faces[1:] + faces[:-1]), 0, axis)
    return found


def velocity_gradients(grid: Grid, state: Arrays) -> Array:
    """(3, 3, nx, ny, nz) derivative of each component of `cell_velocity` along each axis, 1/s.

    Central differences, one-sided at the sides; 0 along an axis of one cell.
    """
    velocity = np.moveaxis(cell_velocity(grid, state), -1, 0).astype(np.float64)
    found = np.zeros((3, 3, *grid.shape))
    for axis in range(3):
        if grid.shape[axis] > 1:
            found[:, axis] = np.gradient(velocity, grid.spacing, axis=1 + axis)
    return found


def vorticity(grid: Grid, state: Arrays) -> Array:
    """(nx, ny, nz, 3) curl of `cell_velocity`, 1/s."""
    (_, uy, uz), (vx, _, vz), (wx, wy, _) = velocity_gradients(grid, state)
    return np.stack([wy - vz, uz - wx, vx - uy], axis=-1)
