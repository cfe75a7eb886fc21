"""The kernels of `dye` in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array
from flowborne.kernels.dye import ALIKE, TINY


def bend_reference(values: Array, clear: Array, least: float, most: float) -> tuple[Array, Array]:
    """`bend_row` in NumPy, for cells in line along the first axis, two more at both ends."""
    q, r, s = values[1:-3], values[2:-2], values[3:-1]
    edges = (7.0 * (values[1:-2] + values[2:-1]) - values[:-3] - values[3:]) / 12.0
    rise, fall = r - edges[:-1], edges[1:] - r
    low = np.clip(rise, np.minimum(r - q, 0.0), np.maximum(r - q, 0.0))
    high = np.clip(fall, np.minimum(s - r, 0.0), np.maximum(s - r, 0.0))
    same = low * high > 0.0
    held_low = np.where(same, np.sign(low) * np.minimum(np.abs(low), 2.0 * np.abs(high)), 0.0)
    held_high = np.where(same, np.sign(low) * np.minimum(np.abs(high), 2.0 * np.abs(low)), 0.0)
    bends = np.diff(values, 2, axis=0)
    three = np.stack([bends[:-2], bends[1:-1], bends[2:]])
    agree = np.where(np.abs(np.sign(three).sum(axis=0)) == 3.0, np.abs(three).min(axis=0), 0.0)
    vertex = (np.abs(rise) + np.abs(fall)) / 3.0
    limits = [
        (ALIKE * agree, 6.0 * np.abs(fall - rise)),
        (np.maximum(most - r, 0.0), np.maximum(np.maximum(-rise, fall), vertex)),
        (np.maximum(r - least, 0.0), np.maximum(np.maximum(rise, -fall), vertex)),
    ]
    part = np.ones(r.shape)
    for room, size in limits:
        part = np.minimum(part, room / np.maximum(size, TINY))
    smooth = ((r - q) * (s - r) <= 0.0) | (rise * fall <= 0.0) | (part >= 1.0)
    return (
        clear * np.where(smooth, part * rise, held_low),
        clear * np.where(smooth, part * fall, held_high),
    )


def sweep_reference(
    field: Array,
    volume: Array,
    flux: Array,
    clear: Array,
    ends: Array,
    wraps: bool,
    dt: float,
    least: float,
    most: float,
) -> tuple[Array, Array, Array]:
    """`sweep` in NumPy: field and volumes after it, and what crossed both sides."""
    lines, flow = np.moveaxis(field, 1, 0), dt * np.moveaxis(flux, 1, 0)
    first, last = (lines[-2:], lines[:2]) if wraps else (ends[[0, 0]], ends[[1, 1]])
    low, high = bend_reference(
        np.concatenate([first, lines, last]), np.moveaxis(clear, 1, 0), least, most
    )

    def wide(inner: Array, below: Array, above: Array) -> Array:
        return np.concatenate([below[None], inner, above[None]])

    none = np.zeros(ends.shape[1:])
    low, high = (wide(a, *((a[-1], a[0]) if wraps else (none, none))) for a in (low, high))
    v = np.moveaxis(volume, 1, 0)
    value, held = wide(lines, first[-1], last[0]), wide(v, v[-1], v[0])
    part = np.abs(flow) / np.maximum(np.where(flow > 0.0, held[:-1], held[1:]), TINY)
    tilt, bend = low + high, low - high
    ahead = (value + high)[:-1] - 0.5 * part * (tilt[:-1] - (3.0 - 2.0 * part) * bend[:-1])
    back = (value - low)[1:] + 0.5 * part * (tilt[1:] + (3.0 - 2.0 * part) * bend[1:])
    amount = flow * np.where(flow > 0.0, ahead, back)
    later = v - np.diff(flow, axis=0)
    after = (v * lines - np.diff(amount, axis=0)) / later
    return np.moveaxis(after, 0, 1), np.moveaxis(later, 0, 1), amount[[0, -1]]
