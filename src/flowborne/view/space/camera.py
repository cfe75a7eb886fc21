"""Where a run in three dimensions is seen from.

z is up; by default the camera stands before the bodies, on their right, looks a little down,
follows them and never turns.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from flowborne.view.framing import followed, radius_of
from flowborne.view.run import Run
from flowborne.view.shot import CameraShot, Shot

Array = NDArray[np.float64]

FILLED, FILLED_BY_FLUID = 0.8, 0.9
"""Part of the map that the bodies fill at most, or the domain of a fluid."""

CENTRED = 6
"""Rounds in which the middle and the distance are found."""

FLAT, HIGH = 0.62, 0.8
"""Least and largest height of the map over its width."""

WHOLE = 2.0
"""Largest domain of a fluid that is seen whole, in sizes of what the bodies sweep."""

ROOM = 1.8
"""How many times the bodies' size is seen where the domain is larger, or one body is followed."""


@dataclass(frozen=True, eq=False)
class Camera:
    """What is seen of each frame.

    focus   (frames, 3) m, place in the middle of the map
    away    (frames, 3) m, the camera's place from there
    lens    angle between the lower and the upper edge of the map
    aspect  height of the map over its width
    """

    focus: Array
    away: Array
    lens: float
    aspect: float

    @property
    def distance(self) -> float:
        """m, of the camera from the focus; of one that comes and goes the middle one."""
        return float(np.median(np.linalg.norm(self.away, axis=1)))

    @property
    def height(self) -> float:
        """m from the lower to the upper edge of the map, where the focus is."""
        return float(2.0 * self.distance * np.tan(0.5 * self.lens))

    @property
    def width(self) -> float:
        """m from the left to the right edge of the map, where the focus is."""
        return self.height / self.aspect

    def axes(self, number: int) -> Array:
        """(3, 3) axes of the map in the world: to the right, upwards, and towards the camera."""
        return np.asarray(_axes(self.away[number][None])[0])


def camera_of(run: Run, shot: Shot, aspect: float | None = None) -> Camera:
    """The camera of a run; what it sees has the same size in all frames unless it stands still.

    The domain of a fluid is seen whole where the bodies fill much of it, and where there are none.
    Sources of dye nearby are seen as well, where dye is.

    aspect  height over width that the map must have, if any
    raises  ValueError when it follows a body that is not there
    """
    path, seen = followed(run, shot)
    radius, filled = radius_of(seen), FILLED
    if run.grid is not None and shot.camera.follow in ("bodies", "nothing"):
        low, high = np.asarray(run.grid.origin), np.asarray(run.grid.upper)
        filled = FILLED_BY_FLUID
        if radius > 0.0 and np.linalg.norm(high - low) > 2.0 * WHOLE * radius:
            seen = ROOM * seen
            if shot.field == "dye":
                seen = np.concatenate([seen, _sources(run, path, WHOLE * radius)], axis=1)
        else:
            if shot.camera.target is None:
                path = np.broadcast_to(0.5 * (low + high), path.shape)
            whole = np.array(list(product(*zip(low, high, strict=True))))
            seen = np.asarray(whole - path[:, None])
    elif shot.camera.follow != "bodies":
        seen = ROOM * seen
    return _placed(path, seen, shot.camera, run.times, filled, aspect)


def _sources(run: Run, path: Array, far: float) -> Array:
    """(frames, n, 3) m, from the path, the corners of sources of dye that are never farther than
    `far` m from it: what they give off is to be seen as well."""
    corners = [list(product(*box.T)) for box in run.sources]
    around = np.array(corners, float).reshape(-1, 1, 8, 3) - path[:, None]
    near = around[np.linalg.norm(around, axis=-1).max(axis=(1, 2), initial=0.0) <= far]
    return np.asarray(np.moveaxis(near, 0, 1).reshape(len(path), -1, 3))


def _placed(
    path: Array, seen: Array, shot: CameraShot, times: Array, filled: float, aspect: float | None
) -> Camera:
    """Camera as `shot` says; where it leaves that open, so far away that all is seen.

    path    (frames, 3) m, looked at
    seen    (frames, n, 3) m, what is to be seen, from there
    times   (frames,) s
    filled  part of the map that it fills at most
    """
    lens = float(np.radians(shot.lens))
    turned = np.radians(shot.orbit) * (times - times[0])
    if shot.position is not None:
        away = _about_z(np.array(shot.position) - path, turned)
        return Camera(path, away, lens, FLAT if aspect is None else aspect)
    azimuth, elevation = np.radians(shot.azimuth) + turned, np.radians(shot.elevation)
    level = np.array([np.cos(elevation), 0.0, np.sin(elevation)])
    toward = _about_z(np.broadcast_to(level, (len(times), 3)), azimuth)
    still = shot.orbit == 0.0 and shot.target is None
    shift, distance, fitting = _fitted(toward, seen, filled * np.tan(0.5 * lens), aspect, still)
    if shot.distance is not None:
        distance = shot.distance
    return Camera(path + shift, distance * toward, lens, fitting)


def _fitted(
    toward: Array, seen: Array, slope: float, aspect: float | None, free: bool
) -> tuple[Array, float, float]:
    """(frames, 3) m by which the middle of the map is off the path, the distance in m, and the
    aspect with which all that is to be seen, (frames, n, 3), is within the map.

    slope  of the lines of sight between which it has to be, over the middle one
    free   whether the middle may be off the path
    """
    right, up, near = np.einsum("fax,fnx->afn", _axes(toward), seen)
    known = np.isfinite(seen).all(axis=-1)
    right, up, near = right[known], up[known], near[known]
    aside, above, distance, fitting = 0.0, 0.0, np.inf, FLAT
    # what is nearer looks larger, so that the middle depends on the distance and this on it
    for _ in range(CENTRED if right.size else 0):
        depth = 1.0 - near / distance
        aside += free * _middle((right - aside) / depth)
        above += free * _middle((up - above) / depth)
        wide, high = np.abs(right - aside), np.abs(up - above)
        fitting = float(np.clip(high.max() / max(wide.max(), 1e-9), FLAT, HIGH))
        fitting = fitting if aspect is None else aspect
        distance = max((near + high / slope).max(), (near + fitting * wide / slope).max(), 1e-3)
    axes = _axes(toward)
    shift = aside * axes[:, 0] + above * axes[:, 1]
    return shift, float(distance if np.isfinite(distance) else 1.0), fitting


def _axes(away: Array) -> Array:
    """(n, 3, 3) axes of the maps of cameras at `away` (n, 3) from what they look at: to the right,
    upwards, towards the camera. z goes upwards on them; straight above or below, y does."""
    toward = away / np.linalg.norm(away, axis=1, keepdims=True)
    level = np.hypot(toward[:, 0], toward[:, 1]) > 1e-9
    azimuth = np.where(level, np.arctan2(toward[:, 1], toward[:, 0]), -0.5 * np.pi)
    right = np.stack([-np.sin(azimuth), np.cos(azimuth), np.zeros_like(azimuth)], axis=1)
    return np.stack([right, np.cross(toward, right), toward], axis=1)


def _about_z(vectors: Array, angles: Array) -> Array:
    """(n, 3) vectors turned about z by angles (n,)."""
    c, s = np.cos(angles), np.sin(angles)
    x, y, z = vectors.T
    return np.stack([c * x - s * y, s * x + c * y, z], axis=1)


def _middle(values: Array) -> float:
    return float(0.5 * (values.min() + values.max()))
