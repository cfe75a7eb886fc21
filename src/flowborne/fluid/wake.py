"""The wake beyond the side through which the stream leaves: a line of bins of vorticity.

Each bin is BIN cells long and has the circulation G of what is in it, and its first moment M across
the stream (`sea_slab`, `sea_room`). The first is fed by what leaves the domain; all move on with
what leaves. Kelvin's theorem is obeyed: the first bin takes what makes the circulation of all the
fluid 0. What has gone beyond the last bin goes on as that one: a line of moments M per length that
has no end is a source at its beginning.

Places are distances from the exit along the stream. If a domain moves by n cells against it, its
bins are those that `moved` gives for n / BIN, fed with what the cells held that are now outside.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne.fluid.grid import Array, Grid
from flowborne.fluid.sea import Sea

BINS = 64
"""Number of bins: 64 diameters of a wake with 8 cells across one."""

BIN = 8
"""Cells along the stream in a bin: half of it is as near to the exit's ends as one is to the
middle of a body that sheds."""


def wake_shape(grid: Grid, sea: Sea | None) -> tuple[int, int, int]:
    """Shape of the bins of all sides of a domain; of none where it lies in no sea."""
    if sea is None:
        return (0, 0, 0)
    return (2 * len(grid.axes), BINS, 2 if grid.is_slab else 12)


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
    arms = shift if count == 3 else shift @ np.array([[-before.along[1]], [before.along[0]]])
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
