"""Arrows in 3D as one mesh, and a wind as rows of arrows behind the bodies."""

from __future__ import annotations

import numpy as np
import pyvista as pv

from flowborne.kernels.arrays import Array, Integers
from flowborne.view import style
from flowborne.view.glyphs import HEAD_LENGTH, HEAD_WIDTH
from flowborne.view.run import Run
from flowborne.view.space.camera import Camera

SIDES = 16
"""Number of sides of a shaft."""


class Arrows:
    """Arrows in a plotter, none at first.

    most    maximum number of arrows
    colour  of all
    lit     share of their colour that depends on the light, from 0 to 1
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
        """Show arrows from `tails` along `vectors`, both (n, 3) m, with shafts `width` m wide."""
        self._actor.visibility = len(tails) > 0
        if not self._actor.visibility:
            return
        points = np.empty((self._mesh.n_points // (5 * SIDES), 5 * SIDES, 3))
        points[: len(tails)] = arrows(tails, vectors, width)
        # unused arrows lie inside the others, so that the bounds do not change
        points[len(tails) :] = points[0, 0]
        self._mesh.points = points.reshape(-1, 3)


def arrows(tails: Array, vectors: Array, width: float) -> Array:
    """(n, 5 * SIDES, 3) corners of round arrows; the head of a short arrow is scaled down.

    The tip is the last corner of each arrow.

    tails, vectors  (n, 3) m; no vector is 0
    """
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    along = vectors / length
    side = np.cross(along, np.eye(3)[np.argmin(np.abs(along), axis=1)])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    circle = _CIRCLE @ np.stack([side, np.cross(along, side)], axis=1)
    shaft = np.minimum(width, length / HEAD_LENGTH)
    neck, half, wing = length - HEAD_LENGTH * shaft, 0.5 * shaft, 0.5 * HEAD_WIDTH * shaft
    zero = np.zeros_like(shaft)
    profile = [(zero, zero), (zero, half), (neck, half), (neck, wing), (length, zero)]
    rings = [
        (tails + distance * along)[:, None] + radius[:, None] * circle
        for distance, radius in profile
    ]
    return np.concatenate(rings, axis=1)


_TURN = 2.0 * np.pi * np.arange(SIDES) / SIDES
_CIRCLE = np.stack([np.cos(_TURN), np.sin(_TURN)], axis=1)


def _faces() -> Integers:
    """(m, 4) corners of the faces between successive rings of an arrow."""
    corner = np.arange(SIDES)
    following = np.roll(corner, -1)
    band = np.stack([corner, following, following + SIDES, corner + SIDES], axis=1)
    return np.concatenate([band + n * SIDES for n in range(4)])


FACES = _faces()
"""(m, 4) corners of the faces of one arrow."""

TRIANGLES = np.concatenate([FACES[:, [0, 1, 2]], FACES[:, [0, 2, 3]]])
"""(2 m, 3) corners of the same faces in triangles, outward."""


ROWS = 7
"""Rows of arrows between the lower and the upper edge of the map."""

BEHIND = 0.5
"""Distance of the arrows behind the centre of the bodies, in heights of the map."""

LENGTH, WIDTH = 0.42, 0.03
"""Length of an arrow and width of its shaft, in row spacings."""

MAX_DRIFT = 0.22
"""Maximum drift per frame, in row spacings: a faster drift would look like one backwards."""


class WindArrows:
    """Arrows along the wind of a run in a plotter.

    lowest  m, height below which there are no arrows
    """

    def __init__(self, plotter: pv.Plotter, run: Run, camera: Camera, lowest: float) -> None:
        wind = run.wind.sum(axis=0)
        speed = float(np.linalg.norm(wind))
        spacing = camera.height / ROWS
        self._camera = camera
        self._drift = wind * min(1.0, MAX_DRIFT * spacing * run.frames_per_second / speed)
        self._vector = LENGTH * spacing * wind / speed
        self._width = WIDTH * spacing
        self._lowest = lowest + 0.5 * spacing
        # the lattice covers the map behind the bodies for any phase of the pattern
        farther = 1.0 + BEHIND * camera.height / camera.distance
        half = 0.5 * farther * np.array([camera.width, camera.height])
        count = np.ceil(half / spacing).astype(int) + 1
        a, b = (x.ravel() for x in np.meshgrid(*(np.arange(-n - 2.0, n + 1.0) for n in count)))
        right, up, _ = camera.axes(0)
        in_rows = abs(wind @ right) >= abs(wind @ up)
        # odd rows, or columns, are shifted by half
        lattice = [a + 0.5 * (b % 2), b] if in_rows else [a, b + 0.5 * (a % 2)]
        self._lattice = spacing * np.stack(lattice, axis=1)
        self._period = spacing * np.array([1.0, 2.0] if in_rows else [2.0, 1.0])
        self._arrows = Arrows(plotter, len(self._lattice), style.WIND, 0.3)

    def show(self, number: int, time: float) -> None:
        """Show the arrows of a frame; they move with the air, not with the camera."""
        focus = self._camera.focus[number]
        axes = self._camera.axes(number)
        plane, toward = axes[:2], axes[2]
        shift = (self._drift * time - focus) @ plane.T
        on_map = self._lattice + shift % self._period
        centres = focus + on_map @ plane - BEHIND * self._camera.height * toward
        tails = (centres - 0.5 * self._vector)[centres[:, 2] > self._lowest]
        self._arrows.show(tails, np.broadcast_to(self._vector, tails.shape), self._width)
