"""What the circulation of a field and of its wake induces across the far sides of a domain."""

from __future__ import annotations

import numpy as np

from flowborne.fluid import sea_room, sea_slab
from flowborne.fluid.grid import Array, Faces
from flowborne.fluid.sea import Sea, number_of
from flowborne.fluid.sides.side import Place
from flowborne.fluid.wake import followed, moved, wake_line, with_all_circulation_0
from flowborne.kernels.projection import net_out

Normal = dict[Place, Array]
"""Velocity across the faces of sides, like their layers, m/s."""

POOL = 4
"""Cells along each edge of a block in which sources of one sign act as one. The gradients of
swimmer-sea and flyer-air are 3e-4 and 6e-5 off by it, with 8 they are 9e-4 and 1e-4 off."""

SOLVED = 1e-6
"""Net outflow of a cell, over that through one face at the largest velocity, up to which it is what
the pressure solve has left, and no source."""


def induced(field: Faces, sea: Sea, wake: Array, dt: float) -> tuple[Normal, Array]:
    """Of a leak-proof field, for every far side but the exit; and the wake a step later."""
    in_domain = in_slab if sea.far[0].grid.is_slab else in_room
    return in_domain(field, sea, wake, dt)


def in_slab(field: Faces, sea: Sea, wake: Array, dt: float) -> tuple[Normal, Array]:
    """`induced` in two dimensions."""
    grid, later = sea.far[0].grid, np.zeros(wake.shape)
    circulation = sea_slab.node_circulation(field, grid)
    sides = sea_slab.stream_functions(circulation, grid, sea.mirrors)
    if sea.exit is not None:
        line, number = wake_line(sea), number_of(sea.exit)
        bins = with_all_circulation_0(wake[number], circulation.sum(keepdims=True).ravel())
        whole = bins * sea_slab.IMAGES if sea.mirrors else bins
        for place in sea.driven:
            sides[place] += sea_slab.stream_function(line, whole, sea_slab.nodes_of(place))
        rate, speed = sea_slab.leaving(circulation, field, sea.exit, line)
        later[number] = moved(bins, dt * rate, min(1.0, speed * dt / line.length))
    return {p: sea_slab.normal_velocity(sides[p], p) for p in sea.driven}, later


def in_room(field: Faces, sea: Sea, wake: Array, dt: float) -> tuple[Normal, Array]:
    """`induced` in three dimensions."""
    grid, later = sea.far[0].grid, np.zeros(wake.shape)
    x, y, z = (sea_room.edge_circulation(field, grid, axis) for axis in range(3))
    sides = sea_room.potentials((x, y, z), grid, sea.mirrors)
    ends: Normal = {place: np.zeros(()) for place in sea.driven}
    if sea.exit is not None:
        line, number = wake_line(sea), number_of(sea.exit)
        inside = grid.spacing * np.array([x.sum(), y.sum(), z.sum()])
        bins = with_all_circulation_0(wake[number], inside)
        whole = bins * sea_room.images(sea.mirrors)
        source = np.array([sea_room.source_rate(line, whole)])
        groups = sea_room.grouped(line, whole)
        for place in sea.driven:
            for axis, values in sides[place].items():
                edges = sea_room.edges_of(place, axis)
                values += sea_room.potential(groups, edges, axis).reshape(values.shape)
            if source.any():
                ends[place] = sea_room.source_velocity(line.end, source, place)
        rate, speed = sea_room.leaving((x, y, z), field, sea.exit, line)
        later[number] = moved(bins, dt * rate, min(1.0, speed * dt / line.length))
    return {
        place: sea_room.normal_velocity(sides[place], place) + ends[place] for place in sea.driven
    }, later


def after_move(wake: Array, velocity: Faces, before: Sea, after: Sea) -> Array:
    """The wake beyond a domain that has moved by a cell.

    velocity       on the faces before, m/s
    before, after  the sea around the domain
    """
    if before.exit is None or after.exit is None:
        return wake
    place, grid, found = before.exit, before.exit.grid, wake.copy()
    old, new = wake_line(before), wake_line(after)
    if grid.is_slab:
        circulation = sea_slab.node_circulation(velocity, grid)
        left = sea_slab.summed(sea_slab.column(circulation, place), place, new)
    else:
        x, y, z = (sea_room.edge_circulation(velocity, grid, axis) for axis in range(3))
        left = grid.spacing * sea_room.summed(sea_room.layer((x, y, z), place), place, new)
    found[number_of(place)] = followed(wake[number_of(place)], left, old, new)
    return found


def brought(field: Faces, sea: Sea) -> Normal:
    """What a leak-proof field's sources bring to each far side but the exit: mouths, sources, flesh
    that swells."""
    grid = sea.far[0].grid
    rate = np.empty(grid.shape)
    net_out(rate, *field)
    rate *= grid.face_area
    fastest = max(float(np.abs(field[axis]).max()) for axis in grid.axes)
    rate[np.abs(rate) < SOLVED * fastest * grid.face_area] = 0.0
    if not rate.any():
        return {}
    points, rates = pooled(rate, sea)
    through = (sea_slab if grid.is_slab else sea_room).source_velocity
    return {place: through(points, rates, place) for place in sea.driven}


def pooled(rate: Array, sea: Sea) -> tuple[Array, Array]:
    """Middles (n, d), m, and rates (n,) of the sources of either sign in each block of cells, and
    of their images behind mirrors."""
    grid = sea.far[0].grid
    cells, coordinates = np.stack(np.nonzero(rate)), grid.cell_coordinates()
    places = np.stack([coordinates[axis][cells[axis]] for axis in grid.axes], axis=1)
    values = rate[tuple(cells)]
    away = 2 * cells + 1 - np.array(grid.shape)[:, None]  # from the middle, so that mirrors agree
    blocks = np.sign(away) * (np.abs(away) // (2 * POOL) + 1)
    keys = np.stack([*blocks, values > 0.0])
    _, block = np.unique(keys, axis=1, return_inverse=True)
    rates = np.asarray(np.bincount(block.ravel(), values), float)
    weighted = [np.bincount(block.ravel(), values * along) / rates for along in places.T]
    points = np.stack(weighted, axis=1)
    for place in sea.mirrors:
        image = points.copy()
        image[:, place.axis] = 2.0 * place.at - image[:, place.axis]
        points, rates = np.concatenate([points, image]), np.concatenate([rates, rates])
    return points, rates
