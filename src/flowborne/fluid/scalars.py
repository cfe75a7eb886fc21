"""Dye and smoke: cell values carried for pictures, which never cross a body."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flowborne.fluid.advection import (
    CENTRE,
    FEW,
    SMOOTH,
    carry,
    correct,
    departure,
    inlined,
    sample,
    sample_valid,
)
from flowborne.fluid.boundary import Boundaries, BoundaryInflow, Source
from flowborne.fluid.ghosts import edge, pad, pad_cells
from flowborne.fluid.grid import Array, Faces, Grid
from flowborne.kernels.jit import kernel, prange

Mask = NDArray[np.uint8]

NEAR = 3.5
"""Cells from a body within which the path of a scalar is followed in small steps."""


@inlined
def node_sample(nodes: Array, x: float, y: float, z: float) -> float:
    """Linear interpolation of a node field at a position in cells from the lower corner."""
    ni, nj, nk = nodes.shape
    i = min(max(int(x), 0), ni - 2)
    j = min(max(int(y), 0), nj - 2)
    k = min(max(int(z), 0), nk - 2)
    a, b, c = x - i, y - j, z - k
    value = 0.0
    for m in range(2):
        for n in range(2):
            for p in range(2):
                weight = (a if m else 1.0 - a) * (b if n else 1.0 - b) * (c if p else 1.0 - c)
                value += weight * nodes[i + m, j + n, k + p]
    return value


@inlined
def mean_beside(field: Array, valid: Mask, after: Array, i: int, j: int, k: int) -> float:
    """Mean of a padded field over the neighbours of cell (i, j, k) that stay outside every body.

    Bodies are as thick as a cell's diagonal (`coupling.shapes.WATERTIGHT`), so neighbours that are
    outside are on the cell's own side of a body. 0 where there are none.
    """
    layers, pz = (1, 0) if field.shape[2] <= 2 else (3, 1)
    total, count = 0.0, 0
    for m in range(-1, 2):
        for n in range(-1, 2):
            for p in range(layers):
                q = k + p - pz
                if valid[i + 1 + m, j + 1 + n, q + pz] and (
                    node_sample(after, i + m + 0.5, j + n + 0.5, q + 0.5) > 0.0
                ):
                    total += field[i + 1 + m, j + 1 + n, q + pz]
                    count += 1
    return total / count if count else 0.0


@kernel
def carry_beside_bodies(
    out: Array,
    field: Array,
    valid: Mask,
    known: Array,
    cx: Array,
    cy: Array,
    cz: Array,
    before: Array,
    after: Array,
    near: float,
    counts: NDArray[np.int64],
    periodic: Mask,
) -> None:
    """Carry the cells near bodies along paths that stop at the bodies' sides.

    A cell that a body has just left, and whose path ends where nothing was, is filled from beside.

    known          `valid` as numbers
    before, after  distance to the bodies at the nodes at both ends of the step, m; between them
                   the distance at a place on the path changes linearly in time
    """
    flat = counts[2] == 1
    for i in prange(out.shape[0]):
        for j in range(out.shape[1]):
            for k in range(out.shape[2]):
                x, y, z = i + 0.5, j + 0.5, k + 0.5
                here = node_sample(after, x, y, z)
                if here >= near:
                    continue
                if here <= 0.0:
                    out[i, j, k] = 0.0
                    continue
                path = departure(cx, cy, cz, x, y, z, counts, periodic, flat)
                xd, yd, zd = path[0], path[1], path[2]
                dx, dy, dz = xd - x, yd - y, zd - z
                if periodic[0]:
                    dx -= counts[0] * np.round(dx / counts[0])
                if periodic[1]:
                    dy -= counts[1] * np.round(dy / counts[1])
                if periodic[2] and not flat:
                    dz -= counts[2] * np.round(dz / counts[2])
                pieces = int(4.0 * max(abs(dx), abs(dy), abs(dz))) + 2
                reached = 0.0
                for n in range(1, pieces + 1):
                    s = n / pieces
                    px, py, pz = x + s * dx, y + s * dy, z + s * dz
                    there = (1.0 - s) * node_sample(after, px, py, pz)
                    there += s * node_sample(before, px, py, pz)
                    if there <= 0.0:
                        break
                    reached = s
                xd, yd, zd = x + reached * dx, y + reached * dy, z + reached * dz
                if sample(known, xd + 0.5, yd + 0.5, zd + 0.5) > FEW:
                    out[i, j, k] = sample_valid(field, valid, xd + 0.5, yd + 0.5, zd + 0.5)
                else:
                    out[i, j, k] = mean_beside(field, valid, after, i, j, k)


@kernel
def outside_bodies(distance: Array, out: Mask) -> None:
    """1 in the cells whose centre is outside every body."""
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            for k in range(out.shape[2]):
                out[i, j, k] = node_sample(distance, i + 0.5, j + 0.5, k + 0.5) > 0.0


def carry_scalars(
    scalars: dict[str, Array],
    carrier: Faces,
    before: Array,
    after: Array,
    grid: Grid,
    boundaries: Boundaries,
    sources: tuple[Source, ...],
    time: float,
) -> dict[str, Array]:
    """The scalars one step later.

    carrier        padded Faces, cells per step (see `advection.cells_per_step`)
    before, after  distance to the bodies at the nodes at both ends of the step, m
    time           s at the end of the step, for what enters through sides and sources
    """
    if not scalars:
        return {}
    counts = np.array(grid.shape)
    periodic = np.array(boundaries.periodic(), np.uint8)
    inside = np.empty(grid.shape, np.uint8)
    outside_bodies(before, inside)
    valid = pad(inside, grid.axes)
    known = valid.astype(np.float64)
    # in three dimensions a flow stretches dye into threads, whose overshoot would grow without end
    room = SMOOTH if grid.is_slab else 0.0
    later = {}
    for name, values in scalars.items():
        field = pad_cells(values, grid, boundaries)
        enter_sides(field, name, grid, boundaries, time)
        carried = np.empty_like(values)
        carry(carried, field, valid, *carrier, CENTRE, counts, periodic)
        out = np.empty_like(values)
        padded = pad_cells(carried, grid, boundaries)
        enter_sides(padded, name, grid, boundaries, time)
        correct(out, padded, field, valid, *carrier, CENTRE, counts, periodic, room)
        carry_beside_bodies(
            out,
            field,
            valid,
            known,
            *carrier,
            before,
            after,
            NEAR * grid.spacing,
            counts,
            periodic,
        )
        later[name] = out
    for source in sources:
        if source.active(time):
            box = cells_in(source, grid)
            for name in later.keys() & source.scalars.keys():
                later[name][box] = source.scalars[name]
    return later


def enter_sides(field: Array, name: str, grid: Grid, boundaries: Boundaries, time: float) -> None:
    """Set the ghosts of a padded scalar at inflow sides to what enters there."""
    x, y, z = np.meshgrid(*grid.cell_coordinates(), indexing="ij")
    for axis in grid.axes:
        for upper, side in enumerate(boundaries.pair(axis)):
            if isinstance(side, BoundaryInflow) and name in side.scalars:
                layer = edge(axis, -1 if upper else 0)
                places = [c[layer] for c in (x, y, z)]
                places[axis] = np.full_like(
                    places[axis], grid.upper[axis] if upper else grid.origin[axis]
                )
                entering = side.scalars[name](places[0], places[1], places[2], time)
                rest = tuple(a for a in grid.axes if a != axis)
                field[layer] = pad(np.expand_dims(entering, axis), rest)[edge(axis, 0)]


def cells_in(source: Source, grid: Grid) -> tuple[slice, slice, slice]:
    """Cells whose centres lie inside a source's box; all layers of a slab."""
    ranges = []
    for axis, centres in enumerate(grid.cell_coordinates()):
        if axis not in grid.axes:
            ranges.append(slice(None))
            continue
        low = int(np.searchsorted(centres, source.lower[axis], side="left"))
        high = int(np.searchsorted(centres, source.upper[axis], side="right"))
        ranges.append(slice(low, high))
    return ranges[0], ranges[1], ranges[2]
