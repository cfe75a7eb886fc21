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
from flowborne.fluid.convolution import on_planes, with_images
from flowborne.fluid.ghosts import edge
from flowborne.fluid.grid import Array, Faces, Grid
from flowborne.fluid.sides.side import Place
from flowborne.fluid.wake import BINS, WakeLine
from flowborne.kernels.potentials import wake_potential

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


GROUPS = np.repeat([1, 2, 4, 8], [8, 4, 4, 4])
"""Bins that act on the sides together, from the exit on: none is longer than it is far away."""


def images(mirrors: tuple[Place, ...]) -> Array:
    """(12,) a wake on mirrors together with its images, over its own: vorticity across a mirror has
    images of its sign, that along it of the other."""
    total = np.ones((4, 3))
    for place in mirrors:
        image = np.full((4, 3), -1.0)
        image[:, place.axis] = 1.0
        image[1 + place.axis] *= -1.0
        total *= 1.0 + image
    return total.ravel()


Groups = tuple[Array, Array, Array]
"""(k, 3) middles, m, and (k, 3) G and (k, 3, 3) M_ji of what acts together."""


def grouped(line: WakeLine, bins: Array) -> Groups:
    """The GROUPS of bins (BINS, 12)."""
    first = np.cumsum(GROUPS) - GROUPS
    middle = first + 0.5 * GROUPS
    circulation, moment = bins[:, :3], bins[:, 3:].reshape(-1, 3, 3)
    off = line.length * (np.arange(BINS) + 0.5 - np.repeat(middle, GROUPS))
    shifted = moment + np.einsum("k,j,ki->kji", off, line.along, circulation)
    return (line.at(middle), np.add.reduceat(circulation, first), np.add.reduceat(shifted, first))


def potential(groups: Groups, edges: Array, axis: int) -> Array:
    """(n,) component of A on edges (n, 3) along an axis, m^2/s."""
    middles, circulation, moment = groups
    out, (own, arms) = np.empty(len(edges)), (circulation[:, axis], moment[:, :, axis])
    wake_potential(out, edges, middles, np.ascontiguousarray(own), np.ascontiguousarray(arms))
    return out


def source_rate(line: WakeLine, bins: Array) -> float:
    """m^3/s, of the source at the line's end."""
    moment = bins[-1, 3:].reshape(3, 3)
    turning = [moment[j, i] - moment[i, j] for j, i in ((1, 2), (2, 0), (0, 1))]
    return -float(line.along @ turning) / (2.0 * line.length)


def leaving(
    circulation: tuple[Array, Array, Array], velocity: Faces, place: Place, line: WakeLine
) -> tuple[Array, float]:
    """(12,) G and M that leave per time through the exit at a place, and the speed at which the
    vorticity goes, m/s: of the edges next to it.

    circulation  round the edges along each axis, m^2/s
    """
    axis, upper = place.axis, place.upper
    faces = _layer(velocity[axis], axis, -2 if upper else 1) * (1.0 if upper else -1.0)
    rates, moved, size = [], 0.0, 0.0
    for i, edges in enumerate(layer(circulation, place)):
        speed = faces
        for other in (a for a in range(3) if a not in (axis, i)):
            speed = 0.5 * (np.delete(speed, -1, other) + np.delete(speed, 0, other))
        rates.append(speed * edges)
        moved += float(np.abs(rates[-1]).sum())
        size += float(np.abs(edges).sum())
    return summed(rates, place, line), moved / size if size > 0.0 else 0.0


def layer(circulation: tuple[Array, Array, Array], place: Place) -> list[Array]:
    """Circulations round the edges next to a side along each axis, but those on other sides,
    m^2/s."""
    found = []
    for i, edges in enumerate(circulation):
        own = i == place.axis
        inside = [slice(1, -1) if a not in (place.axis, i) else slice(None) for a in range(3)]
        at = (-1 if own else -2) if place.upper else int(not own)
        found.append(_layer(edges, place.axis, at)[tuple(inside)])
    return found


def summed(layer: list[Array], place: Place, line: WakeLine) -> Array:
    """(12,) G and M of what edges next to the exit have along each axis."""
    total, grid = np.zeros((4, 3)), place.grid
    for i, edges in enumerate(layer):
        along = [
            grid.origin[a] + grid.spacing * (np.arange(n) + (0.5 if a == i else 1.0))
            for a, n in enumerate(edges.shape)
        ]
        along[place.axis] = np.array([line.start[place.axis]])
        arms = np.stack(np.meshgrid(*along, indexing="ij"), axis=-1) - line.start
        arms = arms - (arms @ line.along)[..., None] * line.along
        total[0, i] = edges.sum()
        total[1:, i] = np.einsum("xyz,xyzj->j", edges, arms)
    return total.ravel()


def _layer(field: Array, axis: int, at: int) -> Array:
    return field[edge(axis, slice(at, at + 1 or None))]
