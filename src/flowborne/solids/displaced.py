"""Volume that each body displaces: the union of its geometries outside flesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne.kernels.arrays import Array, Integers
from flowborne.shapes.shape import Shape

LINES_PER_SIDE = 200
"""Lines along each side of the quadrature of a shared volume."""

SLAB_LINES = 4000
"""Lines of the quadrature of a shared cross-section."""


@dataclass(frozen=True)
class Solid:
    """One geometry for the quadrature.

    shape     in its own frame
    position  (3,) centre in the frame of the quadrature, m
    rotation  (3, 3) to the frame of the quadrature
    low, high (3,) corners of a box around it in the frame of the quadrature
    volume    volume, m^3 (cross-section in a slab, m^2)
    centroid  (3,) in the frame of the quadrature, m
    """

    shape: Shape
    position: Array
    rotation: Array
    low: Array
    high: Array
    volume: float
    centroid: Array


def united(solids: list[Solid], slab: bool) -> tuple[float, Array]:
    """Volume and centroid of the union of the geometries of one body.

    Disjoint geometries add up exactly. Space that several geometries share (the joints of a curved
    bone made of capsules) would be counted more than once. It is integrated along a fixed lattice
    of parallel lines, exactly along each line, and subtracted. The lines are 200 x 200 over the
    shared region (4000 in a slab); the error is about 1e-4 of the shared part (1e-5 in a slab).

    returns   volume in m^3 and (3,) centroid in the frame of the solids
    """
    total = sum(s.volume for s in solids)
    moment = np.sum([s.volume * s.centroid for s in solids], axis=0)
    region = _shared_region(solids)
    if region is not None:
        origins, direction, weight = _lines(*region, slab)
        crossings = [
            s.shape.crossings((origins - s.position) @ s.rotation, direction @ s.rotation)
            for s in solids
        ]
        shared, first = _excess(crossings, origins, direction)
        total -= weight * shared
        moment = moment - weight * first
    return float(total), moment / total


def _shared_region(solids: list[Solid]) -> tuple[Array, Array] | None:
    """Box around every overlap of two bounding boxes, or None without overlaps."""
    lows, highs = [], []
    for i, a in enumerate(solids):
        for b in solids[:i]:
            low, high = np.maximum(a.low, b.low), np.minimum(a.high, b.high)
            if np.all(high > low):
                lows.append(low)
                highs.append(high)
    if not lows:
        return None
    return np.min(lows, axis=0), np.max(highs, axis=0)


def _lines(low: Array, high: Array, slab: bool) -> tuple[Array, Array, float]:
    """Origins (n, 3), direction (3,) and weight of the lines through the region."""
    if slab:
        step = (high[0] - low[0]) / SLAB_LINES
        x = low[0] + step * (np.arange(SLAB_LINES) + 0.5)
        zero = np.zeros_like(x)
        return np.stack([x, zero, zero], axis=1), np.array([0.0, 1.0, 0.0]), float(step)
    step = (high - low) / LINES_PER_SIDE
    ticks = np.arange(LINES_PER_SIDE) + 0.5
    x, y = np.meshgrid(low[0] + step[0] * ticks, low[1] + step[1] * ticks, indexing="ij")
    origins = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    return origins, np.array([0.0, 0.0, 1.0]), float(step[0] * step[1])


def _excess(
    crossings: list[tuple[Integers, Array, Array]], origins: Array, direction: Array
) -> tuple[float, Array]:
    """Length along all lines counted more than once, and its first moment (3,)."""
    line = np.concatenate([c[0] for c in crossings])
    at = np.concatenate([c[1] for c in crossings])
    order = np.lexsort((at, line))
    line, at = line[order], at[order]
    inside = np.cumsum(np.concatenate([c[2] for c in crossings])[order])[:-1]
    surplus = np.where(line[1:] == line[:-1], np.maximum(inside - 1.0, 0.0), 0.0)
    length = surplus * (at[1:] - at[:-1])
    middle = origins[line[:-1]] + 0.5 * (at[1:] + at[:-1])[:, None] * direction
    return float(length.sum()), np.asarray((length[:, None] * middle).sum(axis=0))
