"""What vorticity in a slab induces on the sides of the domain, by Biot and Savart's law.

A field without divergence has the stream function  psi = -(1/2 pi) sum w ln r  of the circulations
w around its nodes, up to an irrotational stream (`convolution`).
"""

from __future__ import annotations

import numpy as np

from flowborne.fluid.convolution import on_planes
from flowborne.fluid.grid import Array, Faces, Grid
from flowborne.fluid.sides.side import Place


def node_circulation(velocity: Faces, grid: Grid) -> Array:
    """(nx+1, ny+1) circulation around each node inside a slab, m^2/s; 0 on the sides."""
    u, v = velocity[0][:, :, 0], velocity[1][:, :, 0]
    nodes = np.zeros((grid.shape[0] + 1, grid.shape[1] + 1))
    turning = np.diff(v[:, 1:-1], axis=0) - np.diff(u[1:-1], axis=1)
    np.multiply(grid.spacing, turning, out=nodes[1:-1, 1:-1])
    return nodes


def with_images(circulation: Array, mirrors: tuple[Place, ...]) -> tuple[Array, tuple[slice, ...]]:
    """Circulations with their images behind mirrors, and where the domain lies among them."""
    inside = [slice(None), slice(None)]
    for place in mirrors:
        image = -np.flip(circulation, place.axis)
        index = [slice(None), slice(None)]
        index[place.axis] = slice(1, None) if place.upper else slice(None, -1)
        count = circulation.shape[place.axis]
        if place.upper:
            circulation = np.concatenate([circulation, image[tuple(index)]], place.axis)
            inside[place.axis] = slice(count)
        else:
            circulation = np.concatenate([image[tuple(index)], circulation], place.axis)
            inside[place.axis] = slice(count - 1, None)
    return circulation, tuple(inside)


def stream_functions(
    circulation: Array, grid: Grid, mirrors: tuple[Place, ...]
) -> dict[Place, Array]:
    """Stream function at the nodes of each side of a slab, m^2/s, of circulations (nx+1, ny+1)
    around the nodes inside and of their images."""
    extended, inside = with_images(circulation, mirrors)
    found = {}
    for axis in (0, 1):
        first, stop, _ = inside[axis].indices(extended.shape[axis])
        planes = on_planes(extended, axis, (first, stop - 1))
        for upper, values in zip((False, True), planes, strict=True):
            found[Place(grid, axis, upper)] = values[inside[1 - axis]]
    return found


def nodes_of(place: Place) -> Array:
    """(n, 2) the nodes on a side of a slab, m."""
    grid, along = place.grid, 1 - place.axis
    nodes = np.empty((grid.shape[along] + 1, 2))
    nodes[:, along] = grid.origin[along] + grid.spacing * np.arange(grid.shape[along] + 1)
    nodes[:, place.axis] = place.at
    return nodes


def normal_velocity(stream_function: Array, place: Place) -> Array:
    """Velocity across a side, like its layer of faces, m/s, of a stream function at its nodes: its
    differences, so that no fluid appears or goes."""
    across = np.diff(stream_function) / place.grid.spacing
    return across[None, :, None] if place.axis == 0 else -across[:, None, None]


def source_velocity(points: Array, rates: Array, place: Place) -> Array:
    """Velocity across a side, like its layer of faces, m/s, that point sources in or beside a slab
    give it: each face gets the part of the rate that belongs to the angle under which it is seen.

    points  (n, 2) m
    rates   (n,) m^2/s
    """
    x, y = (nodes_of(place)[:, None, :] - points).transpose(2, 0, 1)
    cross, along = x[:-1] * y[1:] - y[:-1] * x[1:], x[:-1] * x[1:] + y[:-1] * y[1:]
    flux = np.abs(np.arctan2(cross, along)) @ rates / (2.0 * np.pi * place.grid.spacing)
    outward = flux if place.upper else -flux
    return outward[None, :, None] if place.axis == 0 else outward[:, None, None]
