"""What a camera looks at: the path it follows, and the window of a slab that is seen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from flowborne.shapes.shape import DIRECTIONS
from flowborne.view.fields import SAMPLES
from flowborne.view.outlines import Outlines, flesh_loops
from flowborne.view.run import Run
from flowborne.view.shot import Shot

Array = NDArray[np.float64]

CALM = 0.4
"""Standard deviation of the Gaussian with which the middle's path is smoothed, s."""


def followed(run: Run, shot: Shot) -> tuple[Array, Array]:
    """(frames, 3) m, the place looked at, and (frames, n, 3) m, what is to be seen, from there.

    Bodies that stand fixed are looked at only where none can move and there is no flesh.
    raises  ValueError when the camera follows a body that is not there
    """
    camera, body = shot.camera, shot.followed(run.bodies)
    if body is not None:
        own = [n for n, geom in enumerate(run.geoms) if geom.body == body]
        places = _placed(run, own) if own else run.every("body_position")[:, [body]]
    else:
        moving = [n for n, geom in enumerate(run.geoms) if geom.body > 0]
        places = swept(run, moving if moving or run.flesh else range(len(run.geoms)))
    if camera.target is not None:
        path = np.broadcast_to(np.array(camera.target, float), (len(run), 3))
    elif camera.follow == "nothing":
        known = places[np.isfinite(places).all(axis=-1)]
        middle = 0.5 * (known.min(axis=0) + known.max(axis=0)) if len(known) else np.zeros(3)
        path = np.broadcast_to(middle, (len(run), 3))
    else:
        path = _smoothed(places, CALM * run.frames_per_second)
    return path, places - path[:, None]


def radius_of(seen: Array) -> float:
    """m, of the sphere about the place looked at that holds everything to be seen."""
    sizes = np.linalg.norm(seen, axis=-1)
    return float(sizes[np.isfinite(sizes)].max(initial=0.0))


def swept(run: Run, geoms: Sequence[int]) -> Array:
    """(frames, n, 3) m, the outermost places of geometries and of all flesh; without any one place,
    the origin."""
    placed = [] if run.flesh is None else [_swept_by_flesh(run)]
    placed += [_placed(run, geoms)] if geoms else []
    return np.concatenate(placed, axis=1) if placed else np.zeros((len(run), 1, 3))


def _placed(run: Run, geoms: Sequence[int]) -> Array:
    """(frames, n, 3) m, the outermost places of geometries."""
    centres, turns = run.every("geom_position"), run.every("geom_rotation")
    placed = [
        centres[:, n, None] + run.geoms[n].shape.outermost() @ np.swapaxes(turns[:, n], 1, 2)
        for n in geoms
    ]
    return np.concatenate(placed, axis=1)


def _swept_by_flesh(run: Run) -> Array:
    """(frames, k, 3) vertices that are in any frame the farthest in one of 26 directions, m."""
    vertices = run.every("flesh_vertices")
    farthest = [np.argmax(places @ DIRECTIONS.T, axis=0) for places in vertices]
    return vertices[:, np.unique(farthest)]


def _smoothed(places: Array, calm: float) -> Array:
    """(frames, 3) smoothed path of the places' mean; `calm` is in frames.

    Beyond its ends the path goes on as it came, so that an even walk keeps its pace to the end.
    Frames whose numbers are lost stay where the last good one was.
    """
    middle = places.mean(axis=1)
    good = np.flatnonzero(np.isfinite(middle).all(axis=1))
    if good.size == 0:
        return np.zeros_like(middle)
    # the path goes on in periods of 2 n frames, of which exp(-5 calm^2 / n^2) is left
    calm = min(calm, 2.0 * good.size)
    room = int(4.0 * calm) + 1
    padded = np.pad(middle[good], ((room, room), (0, 0)), mode="reflect", reflect_type="odd")
    smooth = gaussian_filter1d(padded, calm, axis=0)[room:-room]
    last = np.searchsorted(good, np.arange(len(middle)), side="right") - 1
    return np.asarray(smooth[np.maximum(last, 0)])


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
