"""Colours of all pictures, films and plots: light on dark water."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

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
"""Opacity of flesh that shows its bones."""

DYES = ("#2fd3ee", "#ff72b6", "#b9f24d", "#a992ff")
CURVES = ("#ffb81f", "#5cc8ff", "#ff72b6", "#b9f24d", "#a992ff", "#ff8a5c")

SPIN_LEFT = ("#ffb26b", "#ff4f42", "#7e2231")
"""Colours of strong, middling and weak vorticity that turns counter-clockwise."""

SPIN_RIGHT = ("#74ecff", "#2f8fff", "#15457f")
"""The same for clockwise."""

SPEED = ("#0b1420", "#233a7a", "#6d3fa5", "#c94f7c", "#f7a14a", "#fff3b0")
"""Colours of speed from rest to the highest."""

SUCTION, LEVEL, PUSH = (
    ("#8ff0e4", "#1c8f96", "#123f54"),
    "#101c2a",
    ("#ffd9a0", "#cf7a2c", "#573423"),
)
"""Colours of pressure: the lowest first, the mean, the highest first."""


def rgb(colour: str) -> NDArray[np.float64]:
    """(3,) red, green and blue from 0 to 1 of "#rrggbb"."""
    return np.array([int(colour[n : n + 2], 16) / 255.0 for n in (1, 3, 5)])


def body_colour(body: int, accented: frozenset[int]) -> str:
    """Colour of a body: what stands fixed, what controlled joints carry, and the others."""
    if body == 0:
        return FIXED
    return ACCENT if body in accented else BODY
