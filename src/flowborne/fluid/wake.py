"""The wake beyond the side through which the stream leaves a slab: a line of bins of vorticity.

Each bin is BIN cells long and has the circulation G and the first moment M = sum y w across the
stream of what is in it. The first is fed by what leaves the domain; all move on with what leaves.
Kelvin's theorem is obeyed: the first bin takes what makes the circulation of all the fluid 0. What
has gone beyond the last bin goes on as that one: a line of moments M per length that has no end is
a source of the strength -M / length at its beginning.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne.fluid.biot_savart import node_circulation, nodes_of
from flowborne.fluid.grid import Array, Faces, Grid
from flowborne.fluid.sea import Sea, number_of
from flowborne.fluid.sides.side import Place

BINS = 64
"""Number of bins: 64 diameters of a wake with 8 cells across one."""

BIN = 8
"""Cells along the stream in a bin: half of it is as near to the exit's ends as one is to the
middle of a body that sheds."""


def wake_shape(grid: Grid, sea: Sea | None) -> tuple[int, int, int]:
    """Shape of the bins of all sides of a domain; of none where it lies in no sea."""
    return (2 * len(grid.axes), BINS, 2) if sea is not None and grid.is_slab else (0, 0, 0)


@dataclass(frozen=True)
class WakeLine:
    """Where the bins lie.

    start   (2,) where the line leaves the domain, m
    along   (2,) unit vector of the stream
    length  of a bin, m
    """

    start: Array
    along: Array
    length: float

    @property
    def across(self) -> Array:
        """(2,) unit vector, `along` turned to the left."""
        return np.array([-self.along[1], self.along[0]])

    def middles(self) -> Array:
        """(BINS, 2) middles of the bins, m."""
        return self.start + np.multiply.outer(self.length * (np.arange(BINS) + 0.5), self.along)

    def stream_function(self, bins: Array, nodes: Array, mirrored: bool) -> Array:
        """(n,) at nodes (n, 2), m^2/s.

        bins      (BINS, 2) G, m^2/s, and M, m^3/s
        mirrored  whether the line lies on a mirror, behind which the wake is the same with the
                  opposite circulation
        """
        bins = bins * np.array([0.0, 2.0]) if mirrored else bins
        away = nodes[:, None, :] - self.middles()
        square = np.einsum("nki,nki->nk", away, away)
        circulation = np.einsum("k,nk->n", bins[:, 0], np.log(square))
        moment = np.einsum("k,nk->n", bins[:, 1], (away @ self.across) / square)
        rest = nodes - (self.start + BINS * self.length * self.along)
        angle = np.arctan2(-rest @ self.across, -rest @ self.along)
        source = -bins[-1, 1] / self.length
        return (0.5 * (2.0 * moment - circulation) + source * angle) / (2.0 * np.pi)


def wake_line(sea: Sea) -> WakeLine:
    """The line along the stream through the middle of the domain, or of its mirror."""
    assert sea.exit is not None
    grid, axis, velocity = sea.exit.grid, sea.exit.axis, np.array(sea.side.velocity[:2])
    low, high, along = np.array(grid.origin), np.array(grid.upper), velocity / np.hypot(*velocity)
    middle = np.array(
        [
            (1.0 - part) * a + part * b
            for a, b, part in zip(low, high, sea.side.centre, strict=True)
            if part is not None
        ]
    )[:2]
    end = high[axis] if sea.exit.upper else low[axis]
    way = (end - middle[axis]) / along[axis]
    return WakeLine(middle + way * along, along, BIN * grid.spacing)


def leaving(
    circulation: Array, velocity: Faces, place: Place, line: WakeLine
) -> tuple[Array, float]:
    """(2,) circulation and moment that leave per time through the exit at a place, and the speed
    at which the vorticity goes, m/s: of the column of nodes next to it.

    circulation  (nx+1, ny+1) at the nodes, m^2/s
    """
    axis, h, end = place.axis, place.grid.spacing, -2 if place.upper else 1
    across = velocity[axis][:, :, 0]
    faces, nodes = across[end], circulation[end]
    if axis == 1:
        faces, nodes = across[:, end], circulation[:, end]
    outward = 0.5 * (faces[:-1] + faces[1:]) * (1.0 if place.upper else -1.0)
    rate, size = outward * nodes[1:-1] / h, float(np.abs(nodes).sum())
    arms = (nodes_of(place)[1:-1] - line.start) @ line.across
    speed = h * float(np.abs(rate).sum()) / size if size > 0.0 else 0.0
    return np.array([rate.sum(), rate @ arms]), speed


def with_all_circulation_0(bins: Array, inside: float) -> Array:
    """The bins where the first one balances the circulation inside the domain, m^2/s, and that of
    all others."""
    closed = bins.copy()
    closed[0, 0] = -(inside + float(bins[1:, 0].sum()))
    return closed


def moved(bins: Array, rate: Array, part: float, dt: float) -> Array:
    """The bins a step later.

    rate  what comes into the first per time
    part  of a bin that the wake moves by, at most 1
    """
    before = np.concatenate([np.zeros((1, bins.shape[1])), bins[:-1]])
    later = bins + part * (before - bins)
    later[0] += dt * rate
    return later


def followed(bins: Array, velocity: Faces, before: Sea, after: Sea) -> Array:
    """The bins (sides, BINS, 2) beyond a domain that has moved by a cell. The wake stays where it
    is in the world, and the first bin takes the column of nodes that the exit has left behind.

    velocity       on the faces before, m/s
    before, after  the sea around the domain
    """
    if before.exit is None or after.exit is None:
        return bins
    old, new, place = wake_line(before), wake_line(after), before.exit
    moved_by, found = new.start - old.start, bins.copy()
    away, line = float(moved_by @ old.along), found[number_of(place)]
    line[:, 1] -= (moved_by @ old.across) * line[:, 0]
    next_ones = np.concatenate([line[1:], line[-1:]])
    last_ones = np.concatenate([np.zeros((1, 2)), line[:-1]])
    line += abs(away) / old.length * ((next_ones if away > 0.0 else last_ones) - line)
    if away < 0.0:
        column = np.moveaxis(node_circulation(velocity, place.grid), place.axis, 0)
        left = column[-2 if place.upper else 1]
        line[0] += left.sum(), left @ ((nodes_of(place) - new.start) @ new.across)
    return found
