"""What vorticity in a room induces on the sides of the domain, by Biot and Savart's law.

A field without divergence is the curl of the vector potential  A = (1/4 pi) sum G h / r  of the
circulations G round its edges, up to an irrotational stream. Each component, on the edges along its
axis, is a sum over all edges along it (`convolution`). The velocity across a face of a side is the
circulation of A around it over its area, so that no fluid appears or goes.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from flowborne.fluid.boundary import places
from flowborne.fluid.convolution import on_planes
from flowborne.fluid.grid import Array, Faces, Grid
from flowborne.fluid.sides.side import Place

OnSide = dict[int, Array]
"""Component of A -> its values on the edges of a side along that axis, like the side's layer."""


def edge_circulation(velocity: Faces, grid: Grid, axis: int) -> Array:
    """Circulation round the edges along `axis` inside a room, m^2/s; 0 round those on the sides.

    returns  (n along the axis, n+1 along the others)
    """
    one, other = (axis + 1) % 3, (axis + 2) % 3
    inner, inside = [slice(None)] * 3, [slice(None)] * 3
    inner[other], inside[one] = slice(1, -1), slice(1, -1)
    turning = np.diff(velocity[other][tuple(inner)], axis=one)
    turning -= np.diff(velocity[one][tuple(inside)], axis=other)
    edges = np.zeros([n + (a != axis) for a, n in enumerate(grid.shape)])
    inner[one] = slice(1, -1)
    np.multiply(grid.spacing, turning, out=edges[tuple(inner)])
    return edges


def with_images(
    circulation: Array, axis: int, mirrors: tuple[Place, ...]
) -> tuple[Array, tuple[slice, slice, slice]]:
    """Circulations round edges along `axis` with their images behind mirrors, and where the domain
    lies among them. Vorticity across a mirror has images of its sign, that along it of the other.
    """
    inside = [slice(None)] * 3
    for place in mirrors:
        own, count = place.axis == axis, circulation.shape[place.axis]
        image = np.flip(circulation, place.axis) * (1.0 if own else -1.0)
        index = [slice(None)] * 3
        if not own:  # edges on the mirror are their own images
            index[place.axis] = slice(1, None) if place.upper else slice(None, -1)
        parts = [circulation, image[tuple(index)]]
        inside[place.axis] = slice(count) if place.upper else slice(-count, None)
        circulation = np.concatenate(parts if place.upper else parts[::-1], place.axis)
    return circulation, (inside[0], inside[1], inside[2])


def potentials(
    circulation: tuple[Array, Array, Array], grid: Grid, mirrors: tuple[Place, ...]
) -> dict[Place, OnSide]:
    """Both tangential components of A on the edges of each side.

    circulation  round the edges along each axis, m^2/s
    """
    found: dict[Place, OnSide] = {place: {} for place in places(grid)}
    for axis in grid.axes:
        extended, inside = with_images(circulation[axis], axis, mirrors)
        for across in (a for a in grid.axes if a != axis):
            first, stop, _ = inside[across].indices(extended.shape[across])
            others = tuple(s for a, s in enumerate(inside) if a != across)
            planes = on_planes(extended, across, (first, stop - 1))
            for upper, values in zip((False, True), planes, strict=True):
                values = np.expand_dims(values[others], across)
                found[Place(grid, across, upper)][axis] = values
    return found


@lru_cache(maxsize=64)
def edges_of(place: Place, axis: int) -> Array:
    """(n, 3) middles of the edges of a side along `axis`, m, in the order of its layer; not to be
    written."""
    grid = place.grid
    along = [
        grid.origin[a] + grid.spacing * (np.arange(grid.shape[a] + (a != axis)) + 0.5 * (a == axis))
        for a in range(3)
    ]
    along[place.axis] = np.array([place.at])
    found = np.stack([c.ravel() for c in np.meshgrid(*along, indexing="ij")], axis=1)
    found.flags.writeable = False
    return found


def normal_velocity(potential: OnSide, place: Place) -> Array:
    """Velocity across a side, like its layer of faces, m/s, of A on its edges."""
    one, other = (place.axis + 1) % 3, (place.axis + 2) % 3
    turning = np.diff(potential[other], axis=one) - np.diff(potential[one], axis=other)
    return np.asarray(turning / place.grid.spacing)


def source_velocity(points: Array, rates: Array, place: Place) -> Array:
    """Velocity across a side, like its layer of faces, m/s, that point sources in or beside a room
    give it: each face gets the part of the rate that belongs to the solid angle under which it is
    seen (Van Oosterom and Strackee 1983 have the formula of a rectangle).

    points  (n, 3) m
    rates   (n,) m^3/s
    """
    grid, axis = place.grid, place.axis
    one, other = (a for a in range(3) if a != axis)
    nodes = [grid.origin[a] + grid.spacing * np.arange(grid.shape[a] + 1) for a in (one, other)]
    flux = np.zeros((grid.shape[one], grid.shape[other]))
    for point, rate in zip(points, rates, strict=True):
        x, y, z = nodes[0][:, None] - point[one], nodes[1] - point[other], place.at - point[axis]
        seen = np.arctan(x * y / (z * np.sqrt(x * x + y * y + z * z)))
        flux += rate * np.diff(np.diff(seen, axis=0), axis=1)
    return np.expand_dims(flux / (4.0 * np.pi * grid.spacing**2), axis)
