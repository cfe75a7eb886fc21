"""Fields and sides as kernels take them: layers, axes, and what lies beyond each side."""

from __future__ import annotations

from math import prod
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.grid import Grid
from flowborne.fluid.sides.side import tangential_change
from flowborne.kernels.arrays import PRESCRIBED, Faces
from flowborne.kernels.carry import Sides

Scalar = TypeVar("Scalar", bound=np.generic)


def edge(axis: int, at: int | slice) -> tuple[int | slice, ...]:
    """Index of one layer across `axis`."""
    index: list[int | slice] = [slice(None)] * 3
    index[axis] = at
    return tuple(index)


def plane(values: NDArray[Scalar], grid: Grid) -> NDArray[Scalar]:
    """A field of a slab as one of a room that is one layer thick along its first axis."""
    if not grid.is_slab:
        return values
    return values.reshape(1, *values.shape[:2])


def planes(faces: Faces, grid: Grid) -> Faces:
    """Fields on the faces in the order of the kernels' axes; of a slab none across its first, which
    takes no part."""
    x, y, z = faces
    return (plane(x, grid), plane(x, grid), plane(y, grid)) if grid.is_slab else (x, y, z)


def impose_sides(velocity: Faces, grid: Grid, boundaries: Boundaries, time: float) -> None:
    """Set the normal velocity on the sides that prescribe it, and join periodic ends."""
    for place, across in boundaries.across(grid, time):
        velocity[place.axis][place.layer] = across
    join_ends(velocity, grid, boundaries)


def join_ends(field: Faces, grid: Grid, boundaries: Boundaries) -> None:
    """Give the last faces of each periodic axis what the first ones have."""
    for axis in grid.axes:
        if boundaries.periodic()[axis]:
            field[axis][edge(axis, -1)] = field[axis][edge(axis, 0)]


def packed_sides(
    component: int, grid: Grid, boundaries: Boundaries, times: list[float], flux: Faces
) -> Sides:
    """The sides as a component's kernels take them, and what they prescribe to it at these times;
    see `kernels.carry`.

    flux  volume per time through each face, m^3/s
    """
    kept = boundaries.steady_layers(grid)
    if kept is not None and (component, len(times)) in kept:
        table, wide, along, rate, share = kept[component, len(times)]
        return Sides(table, wide, along, np.zeros(rate.size), np.zeros(share.size))
    rows, walls, changes, first = [], [], [], 0
    shape = grid.face_shape(component)
    for place, side in boundaries.around(grid):
        own, layer = place.axis == component, list(shape)
        layer[place.axis] = 1
        size = prod(layer)
        prescribed = np.zeros((len(times), size))
        # across its own side what enters has its velocity again between substeps only
        asked = slice(1, -1) if own else slice(None)
        if (side.normal if own else side.tangential) == PRESCRIBED:
            for wall, time in zip(prescribed[asked], times[asked], strict=True):
                wall.reshape(layer)[:] = side.prescribed_velocity(place, component, time)
        change, still = np.zeros(layer), side.irrotational_inflow(place)
        if own:
            still &= boundaries.sea(grid) is not None
        elif still:
            normal = flux[place.axis][place.layer] / grid.face_area
            change = tangential_change(normal, place, component, boundaries.periodic()[component])
        axis, rules = place.axis + grid.is_slab, (side.normal, side.tangential)
        rows.append((axis, place.upper, *rules, side.supplies, first, still))
        walls.append(prescribed)
        changes.append(change.reshape(-1))
        first += size
    wide, along = np.concatenate(walls, axis=1), np.concatenate(changes)
    made = Sides(np.array(rows, np.int64), wide, along, np.zeros(first), np.zeros(first))
    if kept is not None:
        kept[component, len(times)] = made
    return made
