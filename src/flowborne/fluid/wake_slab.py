"""The bins of a wake in a slab: circulation G = sum w and moment M = sum y w.

y is the distance to the left of the line. The wake beyond the last bin is a source of the rate
-M / length there.
"""

from __future__ import annotations

import numpy as np

from flowborne.fluid.biot_savart import nodes_of
from flowborne.fluid.grid import Array, Faces
from flowborne.fluid.sides.side import Place
from flowborne.fluid.wake import WakeLine

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
