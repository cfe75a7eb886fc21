"""Where the run is seen from at first, and the keys of [film.camera] for where it is seen from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from flowborne.view.outlines import Outlines
from flowborne.view.run import Run
from flowborne.view.space.camera import camera_of
from flowborne.view.window import windows

Array = NDArray[np.float64]

ASPECT = 0.75
"""Height over width of the part of a browser's window that shows the run, about."""


@dataclass(frozen=True)
class Viewpoint:
    """Place of a camera.

    position  (3,) m
    target    (3,) m, looked at
    lens      degrees between the lower and the upper edge
    """

    position: Array
    target: Array
    lens: float

    def film_keys(self, slab: bool) -> dict[str, list[float] | float]:
        """Keys of [film.camera] with which a film sees the same, to a thousandth of the distance.

        A slab is filmed from straight above, at the same distance.
        """
        distance = float(np.linalg.norm(self.position - self.target))
        digits = 3 - int(np.floor(np.log10(distance)))
        target = [round(float(x), digits) + 0.0 for x in self.target]
        lens = round(self.lens, 2)
        if slab:
            return {"target": target, "distance": round(distance, digits), "lens": lens}
        position = [round(float(x), digits) + 0.0 for x in self.position]
        return {"position": position, "target": target, "lens": lens}


@dataclass(frozen=True, eq=False)
class FilmView:
    """What the film of a run sees, as the viewer begins with it.

    first   where the first state is seen from
    path    (n, 3) m, by which the film's camera has gone along since
    side    m, smaller side of what is seen
    up      axis that is upwards on it, "+y" or "+z"
    """

    first: Viewpoint
    path: Array
    side: float
    up: Literal["+y", "+z"]

    @classmethod
    def of(cls, run: Run) -> FilmView:
        """raises  ValueError when its camera follows a body that is not there"""
        lens = run.shot.camera.lens
        if run.slab:
            views = windows(run, Outlines(run), run.shot, ASPECT)
            path = np.column_stack([views[:, :2].mean(axis=1), views[:, 2:].mean(axis=1)])
            path = np.pad(path, ((0, 0), (0, 1)))
            sides = views[0, [1, 3]] - views[0, [0, 2]]
            height = max(sides[1], ASPECT * sides[0])
            away = np.array([0.0, 0.0, 0.5 * height / np.tan(0.5 * np.radians(lens))])
            return cls(Viewpoint(path[0] + away, path[0], lens), path - path[0], sides.min(), "+y")
        camera = camera_of(run, run.shot, ASPECT)
        focus = camera.focus
        first = Viewpoint(focus[0] + camera.away[0], focus[0], lens)
        side = min(camera.width, camera.height)
        return cls(first, focus - focus[0], side, "+z")
