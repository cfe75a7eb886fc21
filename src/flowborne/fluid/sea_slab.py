"""What vorticity in a slab induces on the sides of the domain, by Biot and Savart's law.

A field without divergence has the stream function  psi = -(1/2 pi) sum w ln r  of the circulations
w around its nodes, up to an irrotational stream (`convolution`).
"""

from __future__ import annotations

import numpy as np

from flowborne.fluid.convolution import on_planes, with_images
from flowborne.fluid.grid import Array, Faces, Grid
from flowborne.fluid.sides.side import Place
from flowborne.fluid.wake import WakeLine


def node_circulation(velocity: Faces, grid: Grid) -> Array:
    """(nx+1, ny+1) circulation around each node inside a slab, m^2/s; 0 on the sides."""
    u, v = velocity[0][:, :, 0], velocity[1][:, :, 0]
    nodes = np.zeros((grid.shape[0] + 1, grid.shape[1] + 1))
    turning = np.diff(v[:, 1:-1], axis=0) - np.diff(u[1:-1], axis=1)
    np.multiply(grid.spacing, turning, out=nodes[1:-1, 1:-1])
    return nodes


def stream_functions(
    circulation: Array, grid: Grid, mirrors: tuple[Place, ...]
) -> dict[Place, Array]:
    """Stream function at the nodes of each side of a slab, m^2/s, of circulations (nx+1, ny+1)
    around the nodes inside and of their images."""
    extended, inside = with_images(circulation, 2, mirrors)
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


IMAGES = np.array([0.0, 2.0])
"""G and M of a wake on a mirror together with its image, over its own."""


def across(line: WakeLine) -> Array:
    """(2,) unit vector, the stream's turned to the left."""
    return np.array([-line.along[1], line.along[0]])


def stream_function(line: WakeLine, bins: Array, nodes: Array) -> Array:
    """(n,) of the bins (BINS, 2) at nodes (n, 2), m^2/s."""
    away = nodes[:, None, :] - line.middles
    square = np.einsum("nki,nki->nk", away, away)
    circulation = np.einsum("k,nk->n", bins[:, 0], np.log(square))
    moment = np.einsum("k,nk->n", bins[:, 1], (away @ across(line)) / square)
    rest = nodes - line.end
    angle = np.arctan2(-rest @ across(line), -rest @ line.along)
    source = -bins[-1, 1] / line.length
    return np.asarray((moment - 0.5 * circulation + source * angle) / (2.0 * np.pi))


def leaving(
    circulation: Array, velocity: Faces, place: Place, line: WakeLine
) -> tuple[Array, float]:
    """(2,) circulation and moment that leave per time through the exit at a place, and the speed
    at which the vorticity goes, m/s: of the column of nodes next to it.

    circulation  (nx+1, ny+1) at the nodes, m^2/s
    """
    axis, nodes = place.axis, column(circulation, place)
    normal = velocity[axis][:, :, 0]
    end = -2 if place.upper else 1
    faces = normal[end] if axis == 0 else normal[:, end]
    outward = 0.5 * (faces[:-1] + faces[1:]) * (1.0 if place.upper else -1.0)
    rate, size = outward * nodes / place.grid.spacing, float(np.abs(nodes).sum())
    speed = float(np.abs(outward * nodes).sum()) / size if size > 0.0 else 0.0
    return summed(rate, place, line), speed


def column(circulation: Array, place: Place) -> Array:
    """Circulations (n,) around the nodes next to a side, but those on other sides, m^2/s."""
    end = -2 if place.upper else 1
    return (circulation[end] if place.axis == 0 else circulation[:, end])[1:-1]


def summed(column: Array, place: Place, line: WakeLine) -> Array:
    """(2,) G and M of a column next to the exit."""
    arms = (nodes_of(place)[1:-1] - line.start) @ across(line)
    return np.array([column.sum(), column @ arms])
