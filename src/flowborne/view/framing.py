"""What a camera looks at: its smooth path, which follows bodies or a domain that moves by whole
cells, and the window of a slab that it shows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import gaussian_filter1d

from flowborne.kernels.arrays import Array
from flowborne.shapes.shape import DIRECTIONS
from flowborne.view.fields import SAMPLES
from flowborne.view.outlines import Outlines, flesh_loops
from flowborne.view.run import Run
from flowborne.view.shot import Shot

SMOOTHING = 0.4
"""Standard deviation of the Gaussian that smooths the camera's path, s."""

MAX_WHOLE_DOMAIN = 6.0
"""Largest fluid domain that is shown whole, in sizes of the volume swept by the bodies."""

ROOM = 3.0
"""Height of the view of a larger domain or around a followed body, in sizes of the bodies."""

ASPECT = 0.75
"""Default height of a window over its width."""

MIN_SIDE = 0.4
"""Smaller side of a window that shows the whole way of a domain, at least, in larger sides."""


def followed(run: Run, shot: Shot) -> tuple[Array, Array]:
    """(frames, 3) m, the target of the camera, and (frames, n, 3) m, what it shows, from there.

    Fixed bodies count only if there are no moving bodies and no flesh.
    raises  ValueError if the camera follows a body that does not exist
    """
    camera, body = shot.camera, shot.followed(run.bodies)
    if body is not None:
        own = [n for n, geom in enumerate(run.geoms) if geom.body == body]
        points = _geom_points(run, own) if own else run.every("body_position")[:, [body]]
    else:
        moving = [n for n, geom in enumerate(run.geoms) if geom.body > 0]
        points = swept(run, moving if moving or run.flesh else range(len(run.geoms)))
    if camera.target is not None:
        path = np.broadcast_to(np.array(camera.target, float), (len(run), 3))
    elif camera.follow == "nothing":
        known = points[np.isfinite(points).all(axis=-1)]
        middle = 0.5 * (known.min(axis=0) + known.max(axis=0)) if len(known) else np.zeros(3)
        path = np.broadcast_to(middle, (len(run), 3))
    else:
        path = smoothed(points.mean(axis=1), run.frames_per_second)
    return path, points - path[:, None]


def radius_of(seen: Array) -> float:
    """Radius of the sphere about the origin that contains all points `seen` (..., n), m."""
    sizes = np.linalg.norm(seen, axis=-1)
    return float(sizes[np.isfinite(sizes)].max(initial=0.0))


def swept(run: Run, geoms: Sequence[int]) -> Array:
    """(frames, n, 3) m, outermost points of geometries and of all flesh; the origin if none.

    Of flesh they are the vertices that are in any frame the farthest in one of 26 directions.
    """
    points = []
    if run.flesh is not None:
        vertices = run.every("flesh_vertices")
        farthest = [np.argmax(frame @ DIRECTIONS.T, axis=0) for frame in vertices]
        points.append(vertices[:, np.unique(farthest)])
    points += [_geom_points(run, geoms)] if geoms else []
    return np.concatenate(points, axis=1) if points else np.zeros((len(run), 1, 3))


def _geom_points(run: Run, geoms: Sequence[int]) -> Array:
    """(frames, n, 3) m, outermost points of geometries."""
    position, rotation = run.every("geom_position"), run.every("geom_rotation")
    points = [
        position[:, n, None] + run.geoms[n].shape.outermost() @ np.swapaxes(rotation[:, n], 1, 2)
        for n in geoms
    ]
    return np.concatenate(points, axis=1)


def windows(run: Run, shot: Shot, aspect: float | None = None) -> Array:
    """(frames, 4) m, (x0, x1, y0, y1) that is shown in each frame; all of one size.

    aspect  height over width that it must have, if any
    raises  ValueError if the camera follows a body that does not exist, or turns
    """
    camera = shot.camera
    if camera.orbit or camera.position is not None:
        raise ValueError(
            "a slab is seen from straight above; drop camera.orbit and camera.position, and give "
            "camera.target and camera.distance"
        )
    path, seen = followed(run, shot)
    radius = radius_of(seen[..., :2])
    if camera.target is None and camera.distance is None:
        whole = _whole_domain(run, shot, radius)
        if whole is None and run.grid is None and camera.follow == "bodies":
            whole = _swept_area(run)
        if whole is not None:
            centre, half = whole
            if aspect is not None:
                width = max(half[0], half[1] / aspect)
                half = np.array([width, aspect * width])
            return _around(centre, half)
    height = ROOM * radius
    if camera.distance is not None:
        height = camera.distance * np.tan(0.5 * np.radians(camera.lens))
    return _around(path[:, :2], height * np.array([1.0 / (aspect or ASPECT), 1.0]))


def _around(centre: Array, half: Array) -> Array:
    """(frames, 4) m, windows (x0, x1, y0, y1) of half sides (2,) around centres (frames, 2)."""
    return np.stack([centre - half, centre + half], axis=2).reshape(-1, 4)


def _whole_domain(run: Run, shot: Shot, radius: float) -> tuple[Array, Array] | None:
    """Centres (frames, 2) and half sides (2,) m of the fluid's domain; None if it is too large.

    From a camera that follows nothing, a domain that moves is shown with its whole way. A camera
    that follows the bodies has a smooth path, and shows what is always inside the domain.

    radius  of the bodies, m
    """
    from_world = shot.camera.follow == "nothing" and bool(run.window_axes)
    if run.grid is None or not (from_world or shot.camera.follow == "bodies"):
        return None
    low, high, path = domain_shown(run, from_world=from_world)
    low, size, path = low[:2], (high - low)[:2], path[:, :2]
    if radius > 0.0 and size.min() > 2.0 * MAX_WHOLE_DOMAIN * radius:
        return None
    half, centre = 0.5 * size, low + 0.5 * size + path
    if from_world:
        half = np.maximum(half, MIN_SIDE * half.max())
    elif run.window_axes:
        gaps = run.origins()[:, :2] - low - path
        least, most = gaps.min(axis=0), gaps.max(axis=0)
        centre = centre + 0.5 * (least + most)
        half = np.maximum(half - 0.5 * (most - least), 0.5 * half)
    return centre, half


def _swept_area(run: Run) -> tuple[Array, Array]:
    """Centres (frames, 2) and half sides (2,) m of the area that bodies sweep, with a margin."""
    outlines = Outlines(run)
    placed = [
        outline
        for state in run.sampled(SAMPLES)
        for outline in [*outlines.placed(state), *flesh_loops(run, state)]
    ]
    points = np.concatenate(placed) if placed else np.zeros((1, 2))
    points = points[np.isfinite(points).all(axis=1)]
    low, high = points.min(axis=0), points.max(axis=0)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    half = half + 0.6 * max(half.max(), 1e-6)
    half = np.maximum(half, 0.8 * half.max())
    return np.broadcast_to(middle, (len(run), 2)), half


def smoothed(path: Array, frames_per_second: float) -> Array:
    """(frames, 3) smoothed `path` (frames, 3), m.

    The path is extrapolated beyond its ends, so that a steady walk keeps its speed to the end.
    Frames with non-finite numbers keep the last finite position.
    """
    good = np.flatnonzero(np.isfinite(path).all(axis=1))
    if good.size == 0:
        return np.zeros_like(path)
    # the extended path has a period of 2 n frames, damped by exp(-5 deviation^2 / n^2)
    deviation = min(SMOOTHING * frames_per_second, 2.0 * good.size)
    pad = int(4.0 * deviation) + 1
    padded = np.pad(path[good], ((pad, pad), (0, 0)), mode="reflect", reflect_type="odd")
    smooth = gaussian_filter1d(padded, deviation, axis=0)[pad:-pad]
    last = np.searchsorted(good, np.arange(len(path)), side="right") - 1
    return np.asarray(smooth[np.maximum(last, 0)])


def window_path(run: Run) -> Array:
    """(frames, 3) m, displacement of the fluid's domain from its start, without jumps by cells.

    It is 0 without a fluid.
    The domain moves when what it follows has moved by a cell. From one move to the next the path is
    straight, and after the last one it goes on by at most a cell.
    """
    path = np.zeros((len(run), 3))
    if not run.window_axes:
        return path
    grid = run.grid_at({})
    frames, moved = np.arange(len(run)), run.origins() - grid.origin
    for axis in run.window_axes:
        known = np.append(0, 1 + np.flatnonzero(np.diff(moved[:, axis])))
        path[:, axis] = np.interp(frames, known, moved[known, axis])
        if len(known) > 1:
            speed = np.diff(moved[known[-2:], axis]) / np.diff(known[-2:])
            beyond = speed * np.maximum(frames - known[-1], 0)
            path[:, axis] += np.clip(beyond, -grid.spacing, grid.spacing)
    return smoothed(path, run.frames_per_second)


def domain_shown(run: Run, *, from_world: bool) -> tuple[Array, Array, Array]:
    """Lower and upper corner (3,) of the fluid's domain at the start, and its path (frames, 3), m.

    from_world  all that it is in during the run, which does not move
    """
    grid = run.grid_at({})
    low, size = np.array(grid.origin), np.array(grid.upper) - grid.origin
    if not from_world:
        return low, low + size, window_path(run)
    origins = run.origins()
    return origins.min(axis=0), origins.max(axis=0) + size, np.zeros((len(run), 3))


def through_window(run: Run, focus: Array) -> Array:
    """(frames, 3) m, `focus`, or the middle of a moving domain along axes on which it gets out."""
    found = focus.copy()
    if run.window_axes:
        grid, origins = run.grid_at({}), run.origins()
        size = grid.spacing * np.array(grid.shape)
        middle = grid.origin + 0.5 * size + window_path(run)
        for axis in run.window_axes:
            inside = (focus[:, axis] > origins[:, axis]) & (
                focus[:, axis] < origins[:, axis] + size[axis]
            )
            if not inside.all():
                found[:, axis] = middle[:, axis]
    return found
