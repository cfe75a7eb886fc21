"""Many arrows in space as one mesh, whose corners alone change from frame to frame."""

from __future__ import annotations

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from flowborne.view.arrows import HEAD_LENGTH, HEAD_WIDTH

Array = NDArray[np.float64]

SIDES = 16
"""Of a shaft."""


class Arrows:
    """Arrows in a plotter, none at first.

    most    how many are shown at once at most
    colour  of all
    lit     how much of their colour depends on the light, from 0 to 1
    """

    def __init__(self, plotter: pv.Plotter, most: int, colour: str, lit: float) -> None:
        rings = 5 * SIDES
        self._mesh = pv.PolyData.from_regular_faces(
            np.zeros((most * rings, 3)), np.concatenate([FACES + n * rings for n in range(most)])
        )
        self._actor = plotter.add_mesh(
            self._mesh, color=colour, ambient=1.0 - lit, diffuse=lit, interpolation="flat"
        )

    def show(self, tails: Array, vectors: Array, width: float) -> None:
        """Show arrows from places `tails` along `vectors`, both (n, 3) m; shafts `width` m wide."""
        self._actor.visibility = len(tails) > 0
        if not self._actor.visibility:
            return
        points = np.empty((self._mesh.n_points // (5 * SIDES), 5 * SIDES, 3))
        points[: len(tails)] = arrows(tails, vectors, width)
        # those that are not needed lie within the others, so that they move no bounds
        points[len(tails) :] = points[0, 0]
        self._mesh.points = points.reshape(-1, 3)


def arrows(tails: Array, vectors: Array, width: float) -> Array:
    """(n, 5 * SIDES, 3) corners of round arrows; one shorter than its head is that head, smaller.

    The tip is the last corner of each.

    tails, vectors  (n, 3) m; no vector is 0
    """
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    along = vectors / length
    side = np.cross(along, np.eye(3)[np.argmin(np.abs(along), axis=1)])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    circle = _CIRCLE @ np.stack([side, np.cross(along, side)], axis=1)
    shaft = np.minimum(width, length / HEAD_LENGTH)
    neck, half, wing = length - HEAD_LENGTH * shaft, 0.5 * shaft, 0.5 * HEAD_WIDTH * shaft
    nothing = np.zeros_like(shaft)
    profile = [(nothing, nothing), (nothing, half), (neck, half), (neck, wing), (length, nothing)]
    rings = [
        (tails + place * along)[:, None] + radius[:, None] * circle for place, radius in profile
    ]
    return np.concatenate(rings, axis=1)


def arrow_mesh(tails: Array, vectors: Array, width: float) -> tuple[Array, NDArray[np.int64]]:
    """Vertices (k, 3) m and triangles (m, 3), outward, of the same arrows."""
    corners = arrows(tails, vectors, width)
    triangles = np.concatenate([FACES[:, [0, 1, 2]], FACES[:, [0, 2, 3]]])
    first = 5 * SIDES * np.arange(len(corners))
    return corners.reshape(-1, 3), (first[:, None, None] + triangles).reshape(-1, 3)


_TURN = 2.0 * np.pi * np.arange(SIDES) / SIDES
_CIRCLE = np.stack([np.cos(_TURN), np.sin(_TURN)], axis=1)


def _faces() -> NDArray[np.int64]:
    """(m, 4) corners of the faces between each ring of an arrow and the next."""
    here = np.arange(SIDES)
    there = np.roll(here, -1)
    band = np.stack([here, there, there + SIDES, here + SIDES], axis=1)
    return np.concatenate([band + n * SIDES for n in range(4)])


FACES = _faces()
"""(m, 4) corners of the faces of one arrow."""
