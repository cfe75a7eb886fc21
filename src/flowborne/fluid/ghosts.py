"""One layer of ghost values around a field, so that kernels sample without asking for sides.

A ghost value is such that the linear interpolation to the side gives what the side prescribes: the
wall's velocity at a no-slip side, the profile at an inflow, the neighbour itself (zero gradient)
at a closed or open side, the value across the domain at a periodic one.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from flowborne.fluid.boundary import Boundaries, Boundary, BoundaryInflow, BoundaryNoSlip
from flowborne.fluid.grid import Array, Faces, Grid
from flowborne.kernels.flux import GHOSTS

Scalar = TypeVar("Scalar", bound=np.generic)


def edge(axis: int, at: int | slice) -> tuple[int | slice, ...]:
    """Index of one layer across `axis`."""
    index: list[int | slice] = [slice(None)] * 3
    index[axis] = at
    return tuple(index)


@lru_cache(maxsize=64)
def side_coordinates(
    grid: Grid, axis: int, upper: bool, component: int
) -> tuple[Array, Array, Array]:
    """Places on a side across `axis` at which `component` lives there, in m; not to be written."""
    coordinates = list(grid.face_coordinates(component))
    coordinates[axis] = np.array([grid.upper[axis] if upper else grid.origin[axis]])
    x, y, z = np.meshgrid(*coordinates, indexing="ij")
    for places in (x, y, z):
        places.flags.writeable = False
    return x, y, z


def wall_velocity(
    side: Boundary, grid: Grid, axis: int, upper: bool, component: int, time: float
) -> Array | float:
    """Velocity `component` that the side prescribes, m/s; broadcasts over the side's layer."""
    if isinstance(side, BoundaryInflow):
        values = side.profile(*side_coordinates(grid, axis, upper, component), time)[component]
        return np.asarray(values, float)
    if isinstance(side, BoundaryNoSlip):
        return side.velocity[component] if component != axis else 0.0
    return 0.0


def pad(values: NDArray[Scalar], axes: tuple[int, ...]) -> NDArray[Scalar]:
    """Copy with one more layer at both ends of each of `axes`; corners hold the nearest value."""
    padded = np.empty([n + 2 * (axis in axes) for axis, n in enumerate(values.shape)], values.dtype)
    padded[tuple(slice(1, -1) if axis in axes else slice(None) for axis in range(3))] = values
    for axis in axes:
        padded[edge(axis, 0)] = padded[edge(axis, 1)]
        padded[edge(axis, -1)] = padded[edge(axis, -2)]
    return padded


def pad_cells(values: Array, grid: Grid, boundaries: Boundaries) -> Array:
    """Cell field with ghosts: zero gradient, or the other end where periodic."""
    padded = pad(values, grid.axes)
    for axis in grid.axes:
        if boundaries.periodic()[axis]:
            padded[edge(axis, 0)] = padded[edge(axis, -2)]
            padded[edge(axis, -1)] = padded[edge(axis, 1)]
    return padded


def pad_faces(
    velocity: Faces, grid: Grid, boundaries: Boundaries, time: float, rate: bool = False
) -> Faces:
    """The three face fields with ghosts that carry the boundary conditions.

    velocity  Faces, m/s (or an acceleration, with `rate`: then walls prescribe zero)
    returns   Faces, each larger by one layer at both ends of every axis of the grid
    """
    padded = [pad(values, grid.axes) for values in velocity]
    for component in grid.axes:
        field = padded[component]
        for axis in grid.axes:
            if boundaries.periodic()[axis]:
                same = component == axis
                field[edge(axis, 0)] = field[edge(axis, -3 if same else -2)]
                field[edge(axis, -1)] = field[edge(axis, 2 if same else 1)]
                continue
            for upper, side in enumerate(boundaries.pair(axis)):
                if component == axis or not isinstance(side, (BoundaryInflow, BoundaryNoSlip)):
                    continue
                ghost, inner = (-1, -2) if upper else (0, 1)
                wall = (
                    0.0 if rate else wall_velocity(side, grid, axis, bool(upper), component, time)
                )
                if isinstance(wall, np.ndarray):
                    wall = pad(wall, tuple(a for a in grid.axes if a != axis))[edge(axis, 0)]
                field[edge(axis, ghost)] = 2.0 * wall - field[edge(axis, inner)]
    return padded[0], padded[1], padded[2]


def impose_sides(velocity: Faces, grid: Grid, boundaries: Boundaries, time: float) -> None:
    """Set the normal velocity on the sides that prescribe it, and join periodic ends."""
    for axis in grid.axes:
        field = velocity[axis]
        if boundaries.periodic()[axis]:
            field[edge(axis, -1)] = field[edge(axis, 0)]
            continue
        for upper, side in enumerate(boundaries.pair(axis)):
            layer = edge(axis, -1 if upper else 0)
            if isinstance(side, BoundaryInflow):
                wall = wall_velocity(side, grid, axis, bool(upper), axis, time)
                field[layer] = np.asarray(wall)[edge(axis, 0)]
            elif side.kind != "open":
                field[layer] = 0.0


def wrap_deep(padded: NDArray[Scalar], axis: int, period: int) -> None:
    """Set the two layers of ghosts at both ends of a periodic axis, in place.

    period  number of cells along it
    """
    n = padded.shape[axis]
    for ghost in range(GHOSTS):
        padded[edge(axis, ghost)] = padded[edge(axis, ghost + period)]
        padded[edge(axis, n - 1 - ghost)] = padded[edge(axis, n - 1 - ghost - period)]


def fill_ghosts(
    padded: Array, component: int, grid: Grid, boundaries: Boundaries, time: float
) -> None:
    """Set the two layers of ghosts around a face field such that they carry the boundary
    conditions, in place.

    Along the component's own axis they hold what the side's faces do. Along the others the mean of
    the first ghost and its neighbour is what the side prescribes, and the second mirrors the
    next neighbour likewise; beyond closed sides the field is mirrored, beyond open ones it goes on.
    Corners are left alone.
    """
    inner = [slice(GHOSTS, -GHOSTS) if a in grid.axes else slice(None) for a in range(3)]
    for axis in grid.axes:
        own, n = component == axis, padded.shape[axis]

        def at(layer: int, axis: int = axis) -> tuple[slice, ...]:
            index = list(inner)
            index[axis] = slice(layer, layer + 1)
            return tuple(index)

        if boundaries.periodic()[axis]:
            wrap_deep(padded, axis, grid.shape[axis])
            continue
        for upper, side in enumerate(boundaries.pair(axis)):
            first, second, one, two = (n - 2, n - 1, n - 3, n - 4) if upper else (1, 0, 2, 3)
            if own or side.kind == "open":
                padded[at(first)] = padded[at(second)] = padded[at(one)]
            elif isinstance(side, (BoundaryInflow, BoundaryNoSlip)):
                wall = wall_velocity(side, grid, axis, bool(upper), component, time)
                padded[at(first)] = 2.0 * wall - padded[at(one)]
                padded[at(second)] = 2.0 * wall - padded[at(two)]
            else:
                padded[at(first)], padded[at(second)] = padded[at(one)], padded[at(two)]
