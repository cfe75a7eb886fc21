"""Colours of all pictures, films and plots: light on dark water."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flowborne.kernels.arrays import Array, Pixels, Real

PAPER = "#0a121c"
WATER = "#0e1b2b"
TEXT = "#e9eff6"
MUTED = "#8ba0b5"
LINE = "#26384c"

BODY = "#e3eaf2"
FIXED = "#748394"
ACCENT = "#ffb81f"
WIND = "#2f4a66"
FLESH = "#f2a184"
EDGE = "#05090f"
FORCE = "#6dffb0"
FLOOR = "#16273b"
SQUARES = "#2c425b"
MOTES = "#5f7d9c"

SEEN_THROUGH = 0.42
"""Opacity of flesh if its bones are shown."""

DYES = ("#2fd3ee", "#ff72b6", "#b9f24d", "#a992ff")
CURVES = ("#ffb81f", "#5cc8ff", "#ff72b6", "#b9f24d", "#a992ff", "#ff8a5c")

SPIN_LEFT = ("#ffb26b", "#ff4f42", "#7e2231")
"""Colours of strong, medium and weak counter-clockwise vorticity."""

SPIN_RIGHT = ("#74ecff", "#2f8fff", "#15457f")
"""The same for clockwise."""

SPEED = ("#0b1420", "#233a7a", "#6d3fa5", "#c94f7c", "#f7a14a", "#fff3b0")
"""Colours of speed from rest to the highest."""

PRESSURE = ("#8ff0e4", "#1c8f96", "#123f54", "#101c2a", "#573423", "#cf7a2c", "#ffd9a0")
"""Colours of pressure from the lowest to the highest; the middle one is at its mean."""


def rgb(colour: str) -> Array:
    """(3,) red, green and blue from 0 to 1 of "#rrggbb"."""
    return np.array([int(colour[n : n + 2], 16) / 255.0 for n in (1, 3, 5)])


def to_bytes(colours: Real) -> Pixels:
    """Colours from 0 to 1 as bytes, of the same shape."""
    return np.rint(255.0 * colours).astype(np.uint8)


def body_colour(body: int, accented: frozenset[int]) -> str:
    """Colour of a body: the fixed world, a body on a controlled joint, or another one."""
    if body == 0:
        return FIXED
    return ACCENT if body in accented else BODY


def vorticity_table(count: int) -> Pixels:
    """(count, 4) colours and opacities from strong clockwise to strong counter-clockwise."""
    (right, left), clear = (_stack(SPIN_RIGHT), _stack(SPIN_LEFT)), np.zeros(1)
    colours = np.stack([*right, right[-1], left[-1], *left[::-1]])
    positions = [-1.0, -0.55, -0.2, -1e-9, 1e-9, 0.2, 0.55, 1.0]
    opacity = np.concatenate([np.ones(3), clear, clear, np.ones(3)])
    return _ramp(positions, np.column_stack([colours, opacity]), count)


def number_table(colours: Sequence[str], count: int) -> Pixels:
    """(count, 3) colours evenly along `colours`, from the lowest number to the highest."""
    return _ramp(np.linspace(-1.0, 1.0, len(colours)), _stack(colours), count)


def _stack(colours: Sequence[str]) -> Array:
    return np.stack([rgb(colour) for colour in colours])


def _ramp(positions: Sequence[float] | Array, colours: Array, count: int) -> Pixels:
    """(count, k) colours interpolated linearly between `colours` (n, k) at positions -1 to 1."""
    x = np.linspace(-1.0, 1.0, count)
    return to_bytes(np.stack([np.interp(x, positions, part) for part in colours.T], axis=1))
