"""What vorticity and sources in a domain induce across its sides, by Biot and Savart's law.

A field without divergence is the curl of a vector potential A, up to an irrotational stream. With
the circulations G round the edges of the grid, of which a slab has those along z alone,

    A = (1/4 pi) sum G h / r   in a room          A_z = -(1/2 pi) sum G ln r   in a slab

Each component, on the edges along its axis, is a sum over all edges along it. In a plane every edge
has the same potential about it, so sums over a plane are convolutions, computed by Fourier
transforms of twice the size: with no images, and to rounding. The planes are added up one by one.
The velocity across a face of a side is the circulation of A around it over its area, so that no
fluid appears or goes.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy import fft

from flowborne.fluid.boundary import places
from flowborne.fluid.ghosts import edge, plane, planes
from flowborne.fluid.grid import Grid
from flowborne.fluid.sides.far import Sea
from flowborne.fluid.sides.side import Place
from flowborne.kernels.arrays import Array, Faces
from flowborne.kernels.potentials import sum_layers
from flowborne.kernels.projection import net_out

TOGETHER = 16
"""Points whose angles are found at once: few enough for a core's cache."""

Normal = dict[Place, Array]
"""Velocity across the faces of sides, like their layers, m/s."""

OnEdges = dict[int, Array]
"""Along each axis a quantity on the edges along it: of the grid, or of a side, like its layer."""

POOL = 4
"""Cells along each edge of a block in which sources of one sign act as one. The gradients of
swimmer-sea and flyer-air are 3e-4 and 6e-5 off by it, with 8 they are 9e-4 and 1e-4 off."""

SOLVED = 1e-6
"""Net outflow of a cell, over that through one face at the largest velocity, up to which it is what
the pressure solve has left, and no source."""


def circulations(velocity: Faces, grid: Grid) -> OnEdges:
    """Circulation round the edges inside a domain, m^2/s, (n along their axis, n+1 along the
    others); 0 round those on the sides."""
    found = {}
    for axis in (2,) if grid.is_slab else range(3):
        one, other = (axis + 1) % 3, (axis + 2) % 3
        inner = edge(other, slice(1, -1))
        turning = np.diff(velocity[other][inner], axis=one)
        turning -= np.diff(velocity[one][edge(one, slice(1, -1))], axis=other)
        found[axis] = np.zeros([n + (a != axis) for a, n in enumerate(grid.shape)])
        np.multiply(grid.spacing, turning, out=found[axis][inner][edge(one, slice(1, -1))])
    return found


def potentials(
    circulation: OnEdges, grid: Grid, mirrors: tuple[Place, ...]
) -> dict[Place, OnEdges]:
    """Tangential components of A on the edges of each side, m^2/s, of circulations round the edges
    inside (m^2/s) and of their images."""
    found: dict[Place, OnEdges] = {place: {} for place in places(grid)}
    for axis, own in circulation.items():
        extended, inside = with_images(own, axis, mirrors)
        for across in (a for a in grid.axes if a != axis):
            first, stop, _ = inside[across].indices(extended.shape[across])
            others = tuple(s for a, s in enumerate(inside) if a != across)
            planes = on_planes(extended, across, (first, stop - 1))
            for upper, values in zip((False, True), planes, strict=True):
                values = np.expand_dims(values[others], across)
                found[Place(grid, across, upper)][axis] = values
    return found


def with_images(
    circulation: Array, axis: int, mirrors: tuple[Place, ...]
) -> tuple[Array, tuple[slice, ...]]:
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
    return circulation, tuple(inside)


def on_planes(sources: Array, axis: int, at: tuple[int, ...]) -> list[Array]:
    """Potential of sources on a grid, in a slab one cell thick, on planes across an axis.

    at       indices of planes, without sources
    returns  of each plane, an array of the other axes
    """
    layers = np.ascontiguousarray(np.moveaxis(sources, axis, 0))
    shape = tuple(n for n in layers.shape[1:] if n > 1)
    layers, axes = layers.reshape(len(layers), *shape), tuple(range(1, 1 + len(shape)))
    size = tuple(fft.next_fast_len(2 * n - 1, real=True) for n in shape)
    spectrum = fft.rfftn(layers, size, axes)
    weights, half = _weights(len(layers), size), spectrum.shape[1:]
    spectrum, found = spectrum.reshape(len(layers), -1), []
    for place in at:
        total = np.empty(spectrum.shape[1], complex)
        sum_layers(total, spectrum, weights, place)
        values = fft.irfftn(total.reshape(half), size)[tuple(slice(n) for n in shape)]
        found.append(values.reshape([n for a, n in enumerate(sources.shape) if a != axis]))
    return found


@lru_cache(maxsize=32)
def _weights(layers: int, size: tuple[int, ...]) -> Array:
    """(layers, k) transforms of the potential of a source of 1 around rings of these sizes, at so
    many cells beside its plane: -(1/2 pi) ln r in a slab, 1 / (4 pi r) in a room, r in cells."""
    square = np.arange(layers, dtype=float)[(slice(None), *(None,) * len(size))] ** 2
    for axis, n in enumerate(size):
        along = [-1 if a == axis else 1 for a in range(len(size))]
        square = square + np.reshape(np.minimum(np.arange(n), n - np.arange(n)), (1, *along)) ** 2
    square[(0,) * square.ndim] = 1.0
    one = 1.0 / (4.0 * np.pi * np.sqrt(square))
    potential = one if len(size) == 2 else np.log(square) / (-4.0 * np.pi)
    transform = fft.rfftn(potential, axes=range(1, square.ndim)).real
    found: Array = np.ascontiguousarray(transform).reshape(layers, -1)
    return found


@lru_cache(maxsize=64)
def edges_of(place: Place, axis: int) -> Array:
    """(n, d) middles of the edges of a side along `axis` in d dimensions, m, in the order of its
    layer; not to be written."""
    grid = place.grid
    along = [
        grid.origin[a] + grid.spacing * (np.arange(grid.shape[a] + (a != axis)) + 0.5 * (a == axis))
        for a in range(3)
    ]
    along[place.axis] = np.array([place.at])
    grids = np.meshgrid(*along, indexing="ij")
    found = np.stack([grids[a].ravel() for a in grid.axes], axis=1)
    found.flags.writeable = False
    return found


def normal_velocity(potential: OnEdges, place: Place) -> Array:
    """Velocity across a side, like its layer of faces, m/s, of A on its edges."""
    other, total = (place.axis + 2) % 3, np.zeros(())
    for axis, values in potential.items():
        turning = np.diff(values, axis=3 - place.axis - axis)
        total = total + turning if axis == other else total - turning
    return np.asarray(total / place.grid.spacing)


def source_velocity(points: Array, rates: Array, place: Place) -> Array:
    """Velocity across a side, like its layer of faces, m/s, that point sources in or beside a
    domain give it: each face gets the part of the rate that belongs to the angle, in a room the
    solid angle, under which it is seen (Van Oosterom and Strackee 1983 have the formula of a
    rectangle).

    points  (n, d) m
    rates   (n,) m^3/s, m^2/s in a slab
    """
    grid, axis = place.grid, place.axis
    if grid.is_slab:
        x, y = (edges_of(place, 2)[:, None, :] - points).transpose(2, 0, 1)
        cross, along = x[:-1] * y[1:] - y[:-1] * x[1:], x[:-1] * x[1:] + y[:-1] * y[1:]
        flux = np.abs(np.arctan2(cross, along)) @ rates / (2.0 * np.pi * grid.spacing)
        return (flux if place.upper else -flux).reshape((1, -1, 1) if axis == 0 else (-1, 1, 1))
    one, other = (a for a in range(3) if a != axis)
    nodes = [grid.origin[a] + grid.spacing * np.arange(grid.shape[a] + 1) for a in (one, other)]
    seen = np.zeros((nodes[0].size, nodes[1].size))
    for first in range(0, len(points), TOGETHER):
        few = slice(first, first + TOGETHER)
        x = (nodes[0] - points[few, one, None])[:, :, None]
        y = (nodes[1] - points[few, other, None])[:, None]
        z = (place.at - points[few, axis])[:, None, None]
        angle = np.arctan(x * y / (z * np.sqrt(x * x + y * y + z * z)))
        seen += np.tensordot(rates[few], angle, 1)
    flux = np.diff(np.diff(seen, axis=0), axis=1)
    return np.expand_dims(flux / (4.0 * np.pi * grid.spacing**2), axis)


def brought(field: Faces, sea: Sea) -> Normal:
    """What a leak-proof field's sources bring to each far side but the exit: mouths, sources, flesh
    that swells."""
    grid = sea.far[0].grid
    rate = np.empty(grid.shape)
    net_out(plane(rate, grid), *planes(field, grid))
    rate *= grid.face_area
    fastest = max(float(np.abs(field[axis]).max()) for axis in grid.axes)
    rate[np.abs(rate) < SOLVED * fastest * grid.face_area] = 0.0
    if not rate.any():
        return {}
    points, rates = pooled(rate, sea)
    return {place: source_velocity(points, rates, place) for place in sea.driven}


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
