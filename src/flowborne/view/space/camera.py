"""The camera of a run in three dimensions.

z is up. By default the camera is in front of the bodies, on their right, looks a little down,
follows them and does not turn.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from flowborne.kernels.arrays import Array
from flowborne.scenes.schema_film import CameraTable
from flowborne.view.framing import domain_shown, followed, radius_of
from flowborne.view.run import Run
from flowborne.view.shot import Shot

FILLED, FILLED_BY_FLUID = 0.8, 0.9
"""Maximum part of the map that the bodies, or the domain of a fluid, fill."""

FITTING_ITERATIONS = 6
"""Iterations in which the middle of the map and the distance are found."""

MIN_ASPECT, MAX_ASPECT = 0.62, 0.8
"""Bounds of the height of the map over its width."""

MAX_WHOLE_DOMAIN = 2.0
"""Largest fluid domain that is shown whole, in sizes of the volume swept by the bodies."""

ROOM = 1.8
"""Size of the view of a larger domain or around a followed body, in sizes of the bodies."""


@dataclass(frozen=True, eq=False)
class Camera:
    """Position and lens of the camera in each frame.

    focus   (frames, 3) m, point in the middle of the map
    away    (frames, 3) m, position of the camera relative to the focus
    lens    rad, angle between the lower and the upper edge of the map
    aspect  height of the map over its width
    """

    focus: Array
    away: Array
    lens: float
    aspect: float

    @property
    def distance(self) -> float:
        """Median distance of the camera from the focus, m."""
        return float(np.median(np.linalg.norm(self.away, axis=1)))

    @property
    def height(self) -> float:
        """Height of the map at the focus, m."""
        return float(2.0 * self.distance * np.tan(0.5 * self.lens))

    @property
    def width(self) -> float:
        """Width of the map at the focus, m."""
        return self.height / self.aspect

    def axes(self, number: int) -> Array:
        """(3, 3) axes of the map in the world: right, up, and towards the camera."""
        return np.asarray(_axes(self.away[number][None])[0])


def camera_of(run: Run, shot: Shot, aspect: float | None = None) -> Camera:
    """The camera of a run; the scale is constant unless the position of the camera is fixed.

    The domain of a fluid is shown whole if the bodies fill much of it, or if there are none. A
    domain that follows bodies is shown with its whole way if the camera follows nothing. If dye is
    shown, sources of dye near the bodies are in the view.

    aspect  required height over width of the map, if any
    raises  ValueError if it follows a body that does not exist
    """
    path, seen = followed(run, shot)
    radius, filled = radius_of(seen), FILLED
    if run.grid is not None and shot.camera.follow in ("bodies", "nothing"):
        from_world = shot.camera.follow == "nothing"
        low, high, moved = domain_shown(run, from_world=from_world)
        filled = FILLED_BY_FLUID
        if radius > 0.0 and np.linalg.norm(high - low) > 2.0 * MAX_WHOLE_DOMAIN * radius:
            seen = ROOM * seen
            if shot.field == "dye":
                seen = np.concatenate(
                    [seen, _sources(run, path, MAX_WHOLE_DOMAIN * radius)], axis=1
                )
        else:
            if shot.camera.target is None:
                path = 0.5 * (low + high) + moved
            whole = np.array(list(product(*zip(low, high, strict=True))))
            seen = np.asarray(whole + (moved - path)[:, None])
    elif shot.camera.follow != "bodies":
        seen = ROOM * seen
    return _placed(path, seen, shot.camera, run.times, filled, aspect)


def _sources(run: Run, path: Array, far: float) -> Array:
    """(frames, n, 3) m, corners of the sources of dye within `far` m of the path in all frames.

    They are relative to the path.
    """
    corners = [list(product(*box.T)) for box in run.sources]
    around = np.array(corners, float).reshape(-1, 1, 8, 3) - path[:, None]
    near = around[np.linalg.norm(around, axis=-1).max(axis=(1, 2), initial=0.0) <= far]
    return np.asarray(np.moveaxis(near, 0, 1).reshape(len(path), -1, 3))


def _placed(
    path: Array, seen: Array, shot: CameraTable, times: Array, filled: float, aspect: float | None
) -> Camera:
    """The camera of a shot; by default it is so far away that all points are in the view.

    path    (frames, 3) m, target
    seen    (frames, n, 3) m, points that must be in the view, relative to the target
    times   (frames,) s
    filled  maximum part of the map that they fill
    """
    lens = float(np.radians(shot.lens))
    orbit = np.radians(shot.orbit) * (times - times[0])
    if shot.position is not None:
        away = _about_z(np.array(shot.position) - path, orbit)
        return Camera(path, away, lens, MIN_ASPECT if aspect is None else aspect)
    azimuth, elevation = np.radians(shot.azimuth) + orbit, np.radians(shot.elevation)
    start = np.array([np.cos(elevation), 0.0, np.sin(elevation)])
    toward = _about_z(np.broadcast_to(start, (len(times), 3)), azimuth)
    still = shot.orbit == 0.0 and shot.target is None
    shift, distance, fitting = _fitted(toward, seen, filled * np.tan(0.5 * lens), aspect, still)
    if shot.distance is not None:
        distance = shot.distance
    return Camera(path + shift, distance * toward, lens, fitting)


def _fitted(
    toward: Array, seen: Array, slope: float, aspect: float | None, free: bool
) -> tuple[Array, float, float]:
    """Offset (frames, 3) m of the middle of the map from the path, distance of the camera in m, and
    aspect of the map, with which all points `seen` (frames, n, 3) are in the view.

    slope  of the lines of sight that bound them, over the middle one
    free   whether the middle may be off the path
    """
    right, up, near = np.einsum("fax,fnx->afn", _axes(toward), seen)
    known = np.isfinite(seen).all(axis=-1)
    right, up, near = right[known], up[known], near[known]
    x, y, distance, fitting = 0.0, 0.0, np.inf, MIN_ASPECT
    # nearer points look larger, so that the middle depends on the distance and vice versa
    for _ in range(FITTING_ITERATIONS if right.size else 0):
        depth = 1.0 - near / distance
        x += free * _middle((right - x) / depth)
        y += free * _middle((up - y) / depth)
        wide, high = np.abs(right - x), np.abs(up - y)
        fitting = float(np.clip(high.max() / max(wide.max(), 1e-9), MIN_ASPECT, MAX_ASPECT))
        fitting = fitting if aspect is None else aspect
        distance = max((near + high / slope).max(), (near + fitting * wide / slope).max(), 1e-3)
    axes = _axes(toward)
    shift = x * axes[:, 0] + y * axes[:, 1]
    return shift, float(distance if np.isfinite(distance) else 1.0), fitting


def _axes(away: Array) -> Array:
    """(n, 3, 3) axes of the maps of cameras at `away` (n, 3) from their targets: right, up, towards
    the camera. z is up in the map; seen from straight above or below, y is."""
    toward = away / np.linalg.norm(away, axis=1, keepdims=True)
    inclined = np.hypot(toward[:, 0], toward[:, 1]) > 1e-9
    azimuth = np.where(inclined, np.arctan2(toward[:, 1], toward[:, 0]), -0.5 * np.pi)
    right = np.stack([-np.sin(azimuth), np.cos(azimuth), np.zeros_like(azimuth)], axis=1)
    return np.stack([right, np.cross(toward, right), toward], axis=1)


def _about_z(vectors: Array, angles: Array) -> Array:
    """(n, 3) vectors rotated about z by angles (n,), rad."""
    c, s = np.cos(angles), np.sin(angles)
    x, y, z = vectors.T
    return np.stack([c * x - s * y, s * x + c * y, z], axis=1)


def _middle(values: Array) -> float:
    return float(0.5 * (values.min() + values.max()))
