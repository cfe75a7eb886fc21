"""Light in a room: where it comes from, and how much of it reaches and leaves the smoke."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flowborne.view import style

Array = NDArray[np.float64]
Single = NDArray[np.float32]

KEY = (0.1, 0.75, -1.25)
"""Direction in which the strongest light travels, and shadows fall."""

LIGHTS = (
    (KEY, 0.8, "#fff6e8"),
    ((-0.85, 0.45, -0.3), 0.42, "#cfe2ff"),
    ((0.5, -0.85, -0.7), 0.4, "#8fc2ff"),
)
"""Direction, strength and colour of the lights: from above the camera, its right, and behind."""

AMBIENT = 0.6
"""Light that comes from everywhere, shadow or not."""

BRIGHT = 1.35
"""Light on smoke over that on a body, which has a dark side: smoke is lit from all of them."""

OCTAVES = 3
"""Orders of scattering: each next one has half the strength, and half as much smoke in its way
(Wrenninge, Kulla and Lundqvist 2013)."""

FORWARD = 0.35
"""Mean cosine of the angle by which smoke scatters light (Henyey and Greenstein 1941)."""


def scattered(smoke: Single, solid: Single, toward: Array) -> Single:
    """(nx, ny, nz, 3) light that smoke sends to the camera, about 1 where all lights reach it.

    smoke   (nx, ny, nz) optical depth of a cell
    solid   (nx, ny, nz) part of each cell that a body takes up, which no light crosses
    toward  (3,) unit vector to the camera
    """
    total = np.full((*smoke.shape, 3), AMBIENT, np.float32)
    in_the_way = smoke + 8.0 * solid
    for direction, strength, colour in LIGHTS:
        travel = np.array(direction) / np.linalg.norm(direction)
        depth = optical_depth(in_the_way, travel)
        reached = np.zeros_like(depth)
        for order in range(OCTAVES):
            part = 0.5**order
            reached += part * phase(float(travel @ toward), part * FORWARD) * np.exp(-part * depth)
        total += (BRIGHT * strength * reached)[..., None] * style.rgb(colour).astype(np.float32)
    return total


def phase(cosine: float, forward: float) -> float:
    """Light scattered by an angle, over the mean of all angles (Henyey and Greenstein 1941)."""
    return float((1.0 - forward**2) / (1.0 + forward**2 - 2.0 * forward * cosine) ** 1.5)


def optical_depth(cells: Single, travel: Array) -> Single:
    """(nx, ny, nz) optical depth from outside to the middle of each cell, against the light.

    cells   (nx, ny, nz) optical depth across each cell
    travel  (3,) unit vector along which light travels
    """
    axis = int(np.argmax(np.abs(travel)))
    layers = np.moveaxis(cells, axis, 0)
    layers = layers if travel[axis] > 0.0 else layers[::-1]
    sideways = np.delete(travel, axis) / abs(travel[axis])
    length = np.float32(1.0 / abs(travel[axis]))
    depth = np.empty_like(layers)
    before = np.zeros_like(layers[0])
    for layer, own in enumerate(layers):
        depth[layer] = before + 0.5 * length * own
        before = _shifted(_shifted(before + length * own, sideways[0]).T, sideways[1]).T
    depth = depth if travel[axis] > 0.0 else depth[::-1]
    return np.moveaxis(depth, 0, axis)


def _shifted(values: Single, by: float) -> Single:
    """`values` moved along their first axis by -1 to 1 cells; 0 comes in."""
    moved = np.zeros_like(values)
    if by >= 0.0:
        moved[1:] = values[:-1]
    else:
        moved[:-1] = values[1:]
    share = np.float32(abs(by))
    return (np.float32(1.0) - share) * values + share * moved
