"""The bins of a wake in a room: G_i = int w_i, and M_ji = int y_j w_i with y across the stream.

A bin has the three of G and then the nine of M, i by i within each j. The wake beyond the last bin
is a source of the rate  -e.(y x w) / (2 length)  there, for the stream along e.
"""

from __future__ import annotations

import numpy as np

from flowborne.fluid.ghosts import edge
from flowborne.fluid.grid import Array, Faces
from flowborne.fluid.sides.side import Place
from flowborne.fluid.wake import BINS, WakeLine
from flowborne.kernels.wake_potential import wake_potential

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
    return (
        line.at(middle),
        np.add.reduceat(circulation, first),
        np.add.reduceat(shifted, first),
    )


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
