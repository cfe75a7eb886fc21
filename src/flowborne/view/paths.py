"""Smooth paths of the camera: of the bodies, and of a domain that follows them by whole cells."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from flowborne.kernels.arrays import Array
from flowborne.view.run import Run

SMOOTHING = 0.4
"""Standard deviation of the Gaussian that smooths the camera's path, s."""


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
