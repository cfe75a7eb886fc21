"""Where a run in three dimensions is seen from: a camera that follows the bodies and never turns.

z is up; the camera stands before the bodies, on their right, and looks a little down.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from flowborne.shapes.shape import DIRECTIONS
from flowborne.view.run import Run

Array = NDArray[np.float64]

AZIMUTH, ELEVATION = np.radians(-58.0), np.radians(13.0)
"""Direction of the camera from what it looks at: about z from x, and above the horizon."""

OPENING = np.radians(26.0)
"""Angle between the lower and the upper edge of the map."""

CALM = 0.4
"""Standard deviation of the Gaussian with which the middle's path is smoothed, s."""

FILLED, FILLED_BY_FLUID = 0.8, 0.9
"""Part of the map that the bodies fill at most, or the domain of a fluid."""

CENTRED = 6
"""Rounds in which the middle and the distance are found."""

FLAT, HIGH = 0.62, 0.8
"""Least and largest height of the map over its width."""

WHOLE = 4.5
"""Largest domain of a fluid that is seen whole, in sizes of what the bodies sweep."""

ROOM = 3.5
"""How many times the bodies' size is seen of a larger one."""

TOWARD = np.array(
    [
        np.cos(ELEVATION) * np.cos(AZIMUTH),
        np.cos(ELEVATION) * np.sin(AZIMUTH),
        np.sin(ELEVATION),
    ]
)
RIGHT = np.array([-np.sin(AZIMUTH), np.cos(AZIMUTH), 0.0])
UP = np.cross(TOWARD, RIGHT)
"""Axes of the map in the world: towards the camera, to the right, and upwards."""


@dataclass(frozen=True, eq=False)
class Camera:
    """What is seen of each frame.

    focus     (frames, 3) m, place in the middle of the map
    distance  m, of the camera from it
    aspect    height of the map over its width
    """

    focus: Array
    distance: float
    aspect: float

    @property
    def height(self) -> float:
        """m from the lower to the upper edge of the map, where the focus is."""
        return float(2.0 * self.distance * np.tan(0.5 * OPENING))

    @property
    def width(self) -> float:
        """m from the left to the right edge of the map, where the focus is."""
        return self.height / self.aspect

    def project(self, number: int, points: Array) -> Array:
        """(n, 2) place of `points` (n, 3) on the map of a frame: 0 left and below, 1 right and
        above."""
        away = points - self.focus[number]
        depth = 1.0 - away @ TOWARD / self.distance
        on_map = np.stack([away @ RIGHT / self.width, away @ UP / self.height], axis=-1)
        return np.asarray(0.5 + on_map / depth[:, None])


def camera_of(run: Run) -> Camera:
    """The camera of a run; what it sees has the same size in all frames.

    A fluid is seen whole unless its domain is much larger than the bodies. Bodies that stand fixed
    are looked at only where none can move and there is no flesh.
    """
    moving = [n for n, geom in enumerate(run.geoms) if geom.body > 0]
    places = swept(run, moving if moving or run.flesh else range(len(run.geoms)))
    path = _followed(places, CALM * run.frames_per_second)
    seen = places - path[:, None]
    if run.grid is None:
        return _framed(path, seen, FILLED)
    low, high = np.asarray(run.grid.origin), np.asarray(run.grid.upper)
    sizes = np.linalg.norm(seen, axis=-1)
    radius = sizes[np.isfinite(sizes)].max(initial=0.0)
    if radius > 0.0 and np.linalg.norm(high - low) > 2.0 * WHOLE * radius:
        return _framed(path, ROOM * seen, FILLED_BY_FLUID)
    path = np.broadcast_to(0.5 * (low + high), path.shape)
    whole = np.array(list(product(*zip(low, high, strict=True)))) - path[0]
    return _framed(path, whole, FILLED_BY_FLUID)


def swept(run: Run, geoms: Sequence[int]) -> Array:
    """(frames, n, 3) m, the outermost places of geometries and of all flesh; without any one place,
    the origin."""
    placed = [] if run.flesh is None else [_swept_by_flesh(run)]
    if geoms:
        centres, turns = run.every("geom_position"), run.every("geom_rotation")
        placed += [
            centres[:, n, None] + run.geoms[n].shape.outermost() @ np.swapaxes(turns[:, n], 1, 2)
            for n in geoms
        ]
    return np.concatenate(placed, axis=1) if placed else np.zeros((len(run), 1, 3))


def _swept_by_flesh(run: Run) -> Array:
    """(frames, k, 3) vertices that are in any frame the farthest in one of 26 directions, m."""
    vertices = run.every("flesh_vertices")
    farthest = [np.argmax(places @ DIRECTIONS.T, axis=0) for places in vertices]
    return vertices[:, np.unique(farthest)]


def _followed(places: Array, calm: float) -> Array:
    """(frames, 3) smoothed path of the places' mean; `calm` is in frames.

    Beyond its ends the path goes on as it came, so that an even walk keeps its pace to the end.
    Frames whose numbers are lost stay where the last good one was.
    """
    middle = places.mean(axis=1)
    good = np.flatnonzero(np.isfinite(middle).all(axis=1))
    if good.size == 0:
        return np.zeros_like(middle)
    room = int(4.0 * calm) + 1
    padded = np.pad(middle[good], ((room, room), (0, 0)), mode="reflect", reflect_type="odd")
    smooth = gaussian_filter1d(padded, calm, axis=0)[room:-room]
    last = np.searchsorted(good, np.arange(len(middle)), side="right") - 1
    return np.asarray(smooth[np.maximum(last, 0)])


def _framed(path: Array, seen: Array, filled: float) -> Camera:
    """Camera that keeps all of `seen` (frames, n, 3), relative to the path, within the map.

    filled  part of the map that it fills at most
    """
    seen = seen[np.isfinite(seen).all(axis=-1)]
    right, up, near = seen @ RIGHT, seen @ UP, seen @ TOWARD
    slope = filled * np.tan(0.5 * OPENING)
    aside, above, distance = 0.0, 0.0, np.inf
    # what is nearer looks larger, so that the middle depends on the distance and this on it
    for _ in range(CENTRED):
        depth = 1.0 - near / distance
        aside += _middle((right - aside) / depth)
        above += _middle((up - above) / depth)
        wide, high = np.abs(right - aside), np.abs(up - above)
        aspect = float(np.clip(high.max() / max(wide.max(), 1e-9), FLAT, HIGH))
        distance = max((near + high / slope).max(), (near + aspect * wide / slope).max(), 1e-3)
    return Camera(path + aside * RIGHT + above * UP, float(distance), aspect)


def _middle(values: Array) -> float:
    return float(0.5 * (values.min() + values.max()))
