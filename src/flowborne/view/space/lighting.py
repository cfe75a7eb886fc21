"""The lights in 3D, and the light that smoke receives and scatters to the camera."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Single
from flowborne.view import style

KEY = (0.1, 0.75, -1.25)
"""Direction of the strongest light and of the shadows."""

LIGHTS = (
    (KEY, 0.8, "#fff6e8"),
    ((-0.85, 0.45, -0.3), 0.42, "#cfe2ff"),
    ((0.5, -0.85, -0.7), 0.4, "#8fc2ff"),
)
"""Direction, strength and colour of the lights: from above the camera, from its right, and from
behind the bodies."""

AMBIENT = 0.6
"""Ambient light, which has no shadow."""

SMOKE_BRIGHTNESS = 1.35
"""Light on smoke over that on a body: all lights reach smoke, but a body has a dark side."""

OCTAVES = 3
"""Orders of scattering; each has half the strength and half the optical depth of the previous one
(Wrenninge, Kulla and Lundqvist 2013)."""

FORWARD = 0.35
"""Mean cosine of the scattering angle in smoke (Henyey and Greenstein 1941)."""


def scattered(smoke: Single, solid: Single, toward: Array) -> Single:
    """(nx, ny, nz, 3) light from smoke to the camera, about 1 where all lights reach it.

    smoke   (nx, ny, nz) optical depth of each cell
    solid   (nx, ny, nz) fraction of each cell inside bodies, which block light
    toward  (3,) unit vector to the camera
    """
    total = np.full((*smoke.shape, 3), AMBIENT, np.float32)
    blocking = smoke + 8.0 * solid
    for direction, strength, colour in LIGHTS:
        travel = np.array(direction) / np.linalg.norm(direction)
        depth = optical_depth(blocking, travel)
        reached = np.zeros_like(depth)
        for order in range(OCTAVES):
            part = 0.5**order
            reached += part * phase(float(travel @ toward), part * FORWARD) * np.exp(-part * depth)
        total += (SMOKE_BRIGHTNESS * strength * reached)[..., None] * style.rgb(colour).astype(
            np.float32
        )
    return total


def phase(cosine: float, forward: float) -> float:
    """Light scattered by an angle over the mean of all angles (Henyey and Greenstein 1941)."""
    return float((1.0 - forward**2) / (1.0 + forward**2 - 2.0 * forward * cosine) ** 1.5)


def optical_depth(cells: Single, travel: Array) -> Single:
    """(nx, ny, nz) optical depth from the boundary to the centre of each cell along the light.

    cells   (nx, ny, nz) optical depth across each cell
    travel  (3,) unit vector, direction of the light
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
    """`values` shifted along their first axis by -1 to 1 cells, filled with 0."""
    moved = np.zeros_like(values)
    if by >= 0.0:
        moved[1:] = values[:-1]
    else:
        moved[:-1] = values[1:]
    share = np.float32(abs(by))
    return (np.float32(1.0) - share) * values + share * moved
