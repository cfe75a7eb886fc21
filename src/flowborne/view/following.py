"""What a camera looks at: the path of what it follows, and what is to be seen around it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from flowborne.shapes.shape import DIRECTIONS
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
