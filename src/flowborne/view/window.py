"""What part of a slab is seen: all that there is, or a window that follows the bodies."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flowborne.view.fields import SAMPLES
from flowborne.view.following import followed, radius_of
from flowborne.view.outlines import Outlines, flesh_loops
from flowborne.view.run import Run
from flowborne.view.shot import Shot

Array = NDArray[np.float64]
View = tuple[float, float, float, float]

WHOLE = 6.0
"""Largest domain of a fluid that is seen whole, in sizes of what the bodies sweep."""

ROOM = 3.0
"""How many times the bodies' size is seen of a larger one, and around a body that is followed."""

ASPECT = 0.75
"""Height of a window over its width where nothing else says it."""


def windows(run: Run, outlines: Outlines, shot: Shot, aspect: float | None) -> Array:
    """(frames, 4) m, (x0, x1, y0, y1) that is seen of each frame; all of one size.

    aspect  height over width that it must have, if any
    raises  ValueError when the camera follows a body that is not there, or turns
    """
    camera = shot.camera
    if camera.orbit or camera.position is not None:
        raise ValueError(
            "a slab is seen from straight above; drop camera.orbit and camera.position, and give "
            "camera.target and camera.distance"
        )
    path, seen = followed(run, shot)
    radius = radius_of(seen[..., :2])
    led = camera.target is not None or camera.distance is not None or camera.follow != "bodies"
    if not led and (run.grid is None or radius == 0.0 or _small(run, 2.0 * WHOLE * radius)):
        x0, x1, y0, y1 = whole(run, outlines)
        centre = np.broadcast_to([0.5 * (x0 + x1), 0.5 * (y0 + y1)], (len(run), 2))
        half = _enlarged(0.5 * np.array([x1 - x0, y1 - y0]), aspect)
    else:
        centre = path[:, :2]
        height = ROOM * radius
        if camera.distance is not None:
            height = camera.distance * np.tan(0.5 * np.radians(camera.lens))
        half = height * np.array([1.0 / (aspect or ASPECT), 1.0])
    return np.stack(
        [
            centre[:, 0] - half[0],
            centre[:, 0] + half[0],
            centre[:, 1] - half[1],
            centre[:, 1] + half[1],
        ],
        axis=1,
    )


def whole(run: Run, outlines: Outlines) -> View:
    """(x0, x1, y0, y1) in m: the fluid's domain, or what the bodies sweep and room around it."""
    if run.grid is not None:
        (x0, y0, _), (x1, y1, _) = run.grid.origin, run.grid.upper
        return x0, x1, y0, y1
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
    return middle[0] - half[0], middle[0] + half[0], middle[1] - half[1], middle[1] + half[1]


def _small(run: Run, side: float) -> bool:
    """Whether the smaller side of the fluid's domain is no longer than `side`, m."""
    assert run.grid is not None
    size = np.array(run.grid.upper) - np.array(run.grid.origin)
    return bool(size[:2].min() <= side)


def _enlarged(half: Array, aspect: float | None) -> Array:
    """Half sides (2,) that hold `half` and have an aspect, if one is asked for."""
    if aspect is None:
        return half
    width = max(half[0], half[1] / aspect)
    return np.array([width, aspect * width])
