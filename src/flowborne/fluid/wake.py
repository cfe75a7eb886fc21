"""The wake beyond the side through which the stream leaves: a line of bins of vorticity.

Each bin is BIN cells long and has the circulation G of what is in it, and its first moment M across
the stream: in a room, where both have three components, G_i and then M_ji. The first is fed by what
leaves the domain; all move on with what leaves. Kelvin's theorem is obeyed: the first bin takes
what makes the circulation of all the fluid 0. What has gone beyond the last bin goes on as that
one: a line of moments M per length that has no end is a source at its beginning.

Places are distances from the exit along the stream. If a domain moves by n cells against it, its
bins are those that `moved` gives for n / BIN, fed with what the cells held that are now outside.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne.fluid.ghosts import edge
from flowborne.fluid.grid import Grid
from flowborne.fluid.potential import (
    Normal,
    OnEdges,
    circulations,
    edges_of,
    normal_velocity,
    potentials,
    source_velocity,
)
from flowborne.fluid.sides.far import Sea
from flowborne.fluid.sides.side import Place
from flowborne.kernels.arrays import Array, Faces
from flowborne.kernels.potentials import wake_potential

BINS = 64
"""Number of bins: 64 diameters of a wake with 8 cells across one."""

BIN = 8
"""Cells along the stream in a bin: half of it is as near to the exit's ends as one is to the
middle of a body that sheds."""

GROUPS = np.repeat([1, 2, 4, 8], [8, 4, 4, 4])
"""Bins of a room that act on the sides together, from the exit on: none is longer than it is far
away."""


def wake_shape(grid: Grid, sea: Sea | None) -> tuple[int, int, int]:
    """Shape of the bins of all sides of a domain; of none where it lies in no sea."""
    if sea is None:
        return (0, 0, 0)
    return (2 * len(grid.axes), BINS, 2 if grid.is_slab else 12)


def number_of(place: Place) -> int:
    """Index of a place among the sides of a domain."""
    return 2 * place.axis + place.upper


def induced(field: Faces, sea: Sea, wake: Array, dt: float) -> tuple[Normal, Array]:
    """What the circulation of a leak-proof field and of its wake induces across every far side but
    the exit; and the wake a step later."""
    grid, later = sea.far[0].grid, np.zeros(wake.shape)
    circulation = circulations(field, grid)
    sides = potentials(circulation, grid, sea.mirrors)
    if sea.exit is None:
        return {place: normal_velocity(sides[place], place) for place in sea.driven}, later
    line, number = wake_line(sea), number_of(sea.exit)
    inside = grid.depth * np.array([edges.sum() for edges in circulation.values()])
    bins = with_all_circulation_0(wake[number], inside)
    whole, normal = bins * images(sea.mirrors, grid), {}
    for place in sea.driven:
        for axis, values in of_wake(line, whole, place).items():
            sides[place][axis] += values.reshape(sides[place][axis].shape)
        normal[place] = normal_velocity(sides[place], place)
        if not grid.is_slab:  # where it is in the stream function
            rate = np.array([source_rate(line, whole)])
            normal[place] += source_velocity(line.end, rate, place)
    rate, speed = leaving(circulation, field, sea.exit, line)
    later[number] = moved(bins, dt * rate, min(1.0, speed * dt / line.length))
    return normal, later


def after_move(wake: Array, velocity: Faces, before: Sea | None, after: Sea | None) -> Array:
    """The wake beyond a domain that has moved by a cell.

    velocity       on the faces before, m/s
    before, after  the sea around the domain
    """
    if before is None or after is None or before.exit is None:
        return wake
    place, found, number = before.exit, wake.copy(), number_of(before.exit)
    old, new, depth = wake_line(before), wake_line(after), place.grid.depth
    left = depth * summed(layer(circulations(velocity, place.grid), place), place, new)
    found[number] = followed(wake[number], left, old, new)
    return found


@dataclass(frozen=True)
class WakeLine:
    """Where the bins lie, in the plane of a slab (d = 2) or in a room (d = 3).

    start   (d,) where the line leaves the domain, m
    along   (d,) unit vector of the stream
    length  of a bin, m
    """

    start: Array
    along: Array
    length: float

    def at(self, bins: Array) -> Array:
        """(n, d) places on the line, m, at numbers of bins (n,) from its start."""
        return np.asarray(self.start + self.length * bins[:, None] * self.along)

    @property
    def middles(self) -> Array:
        """(BINS, d) of the bins, m."""
        return self.at(np.arange(BINS, dtype=float) + 0.5)

    @property
    def across(self) -> Array:
        """(2,) unit vector, in a slab: the stream's turned to the left."""
        return np.array([-self.along[1], self.along[0]])

    @property
    def end(self) -> Array:
        """(1, d) where the last bin ends, m."""
        return self.at(np.array([float(BINS)]))


def wake_line(sea: Sea) -> WakeLine:
    """The line along the stream through the middle of the domain, or of its mirrors."""
    assert sea.exit is not None
    grid, axis = sea.exit.grid, sea.exit.axis
    axes = list(grid.axes)
    low, high = np.array(grid.origin)[axes], np.array(grid.upper)[axes]
    parts = [part for part in sea.side.centre if part is not None]
    middle = low + np.array(parts) * (high - low)
    along = np.array(sea.side.velocity)[axes]
    along /= np.linalg.norm(along)
    return WakeLine(
        middle + (sea.exit.at - middle[axis]) / along[axis] * along, along, BIN * grid.spacing
    )


def with_all_circulation_0(bins: Array, inside: Array) -> Array:
    """The bins where the first one balances the circulation inside the domain, and of all others.

    inside  its components, as many as G has: the first columns of the bins
    """
    closed, count = bins.copy(), inside.size
    closed[0, :count] = -(inside + bins[1:, :count].sum(axis=0))
    return closed


def moved(bins: Array, fed: Array, part: float) -> Array:
    """The bins after the wake has moved on by part of a bin, at most 1, and was fed."""
    before = np.concatenate([np.zeros((1, bins.shape[1])), bins[:-1]])
    later = bins + part * (before - bins)
    later[0] += fed
    return later


def followed(bins: Array, left: Array, before: WakeLine, after: WakeLine) -> Array:
    """The bins beyond a domain that has moved by a cell: the wake stays where it is in the world,
    and the first bin takes what the exit has left behind.

    left           of it, as a bin has it, about the line after; used where the exit moved inwards
    before, after  the line then
    """
    moved_by, found = after.start - before.start, bins.copy()
    away, count = float(moved_by @ before.along), 1 if bins.shape[1] == 2 else 3
    shift = moved_by - away * before.along
    arms = shift if count == 3 else shift @ before.across[:, None]
    found[:, count:] -= np.einsum("j,ki->kji", arms, bins[:, :count]).reshape(len(bins), -1)
    part = away / before.length
    if part < 0.0:
        return moved(found, left, -part)
    return np.asarray(found + part * (np.concatenate([found[1:], found[-1:]]) - found))


def resampled(bins: Array, ratio: float) -> Array:
    """Bins (sides, BINS, k) of a grid whose cells are `ratio` times as large, with the same wake.

    Where the line becomes longer, its last bin is continued.
    """
    if bins.size == 0:
        return bins
    filled = np.concatenate([np.zeros_like(bins[:, :1]), np.cumsum(bins, axis=1)], axis=1)
    edges = ratio * np.arange(BINS + 1.0)
    below = np.minimum(edges.astype(int), BINS - 1)
    within = filled[:, below] + (edges - below)[:, None] * bins[:, below]
    return np.diff(within, axis=1)


def images(mirrors: tuple[Place, ...], grid: Grid) -> Array:
    """A wake on mirrors together with its images, over its own: vorticity across a mirror has
    images of its sign, that along it of the other."""
    if grid.is_slab:
        return np.array([0.0, 2.0]) if mirrors else np.ones(2)
    total = np.ones((4, 3))
    for place in mirrors:
        image = np.full((4, 3), -1.0)
        image[:, place.axis] = 1.0
        image[1 + place.axis] *= -1.0
        total *= 1.0 + image
    return total.ravel()


def of_wake(line: WakeLine, bins: Array, place: Place) -> OnEdges:
    """Tangential components of A of the bins on the edges of a side, each (n,), m^2/s."""
    if place.grid.is_slab:
        return {2: stream_function(line, bins, edges_of(place, 2))}
    axes = (axis for axis in range(3) if axis != place.axis)
    return {axis: potential(line, bins, edges_of(place, axis), axis) for axis in axes}


def stream_function(line: WakeLine, bins: Array, nodes: Array) -> Array:
    """(n,) of the bins (BINS, 2), and of the source at their end, at nodes (n, 2), m^2/s."""
    away = nodes[:, None, :] - line.middles
    square = np.einsum("nki,nki->nk", away, away)
    circulation = np.einsum("k,nk->n", bins[:, 0], np.log(square))
    moment = np.einsum("k,nk->n", bins[:, 1], (away @ line.across) / square)
    rest = nodes - line.end
    angle = np.arctan2(-rest @ line.across, -rest @ line.along)
    source = -bins[-1, 1] / line.length
    return np.asarray((moment - 0.5 * circulation + source * angle) / (2.0 * np.pi))


def potential(line: WakeLine, bins: Array, edges: Array, axis: int) -> Array:
    """(n,) component of the bins (BINS, 12) on edges (n, 3) along an axis, m^2/s, by GROUPS."""
    first = np.cumsum(GROUPS) - GROUPS
    middle = first + 0.5 * GROUPS
    own, moment = bins[:, axis], bins[:, 3 + axis :: 3]
    off = line.length * (np.arange(BINS) + 0.5 - np.repeat(middle, GROUPS))
    arms = moment + np.einsum("k,j,k->kj", off, line.along, own)
    sums, out = (np.add.reduceat(each, first) for each in (own, arms)), np.empty(len(edges))
    wake_potential(out, edges, line.at(middle), *sums)
    return out


def source_rate(line: WakeLine, bins: Array) -> float:
    """m^3/s, of the source at the end of a line in a room."""
    moment = bins[-1, 3:].reshape(3, 3)
    turning = [moment[j, i] - moment[i, j] for j, i in ((1, 2), (2, 0), (0, 1))]
    return -float(line.along @ turning) / (2.0 * line.length)


def leaving(
    circulation: OnEdges, velocity: Faces, place: Place, line: WakeLine
) -> tuple[Array, float]:
    """G and M that leave per time through the exit at a place, and the speed at which the
    vorticity goes, m/s: of the edges next to it.

    circulation  round the edges, m^2/s
    """
    axis, grid = place.axis, place.grid
    faces = _layer(velocity[axis], axis, -2 if place.upper else 1) * (1.0 if place.upper else -1.0)
    rates, moved, size = {}, 0.0, 0.0
    for i, edges in layer(circulation, place).items():
        speed = faces
        for other in (a for a in grid.axes if a not in (axis, i)):
            speed = 0.5 * (np.delete(speed, -1, other) + np.delete(speed, 0, other))
        rate = speed * edges
        rates[i] = rate / (grid.spacing / grid.depth)
        moved += float(np.abs(rate).sum())
        size += float(np.abs(edges).sum())
    return summed(rates, place, line), moved / size if size > 0.0 else 0.0


def layer(circulation: OnEdges, place: Place) -> OnEdges:
    """Circulations round the edges next to a side, but those on other sides, m^2/s."""
    found = {}
    for i, edges in circulation.items():
        own = i == place.axis
        inside = [slice(1, -1) if a not in (place.axis, i) else slice(None) for a in range(3)]
        at = (-1 if own else -2) if place.upper else int(not own)
        found[i] = _layer(edges, place.axis, at)[tuple(inside)]
    return found


def summed(layer: OnEdges, place: Place, line: WakeLine) -> Array:
    """G and M of what the edges next to the exit have."""
    grid = place.grid
    if grid.is_slab:
        column = layer[2].reshape(-1)
        arms = (edges_of(place, 2)[1:-1] - line.start) @ line.across
        return np.array([column.sum(), column @ arms])
    total = np.zeros((4, 3))
    for i, edges in layer.items():
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
