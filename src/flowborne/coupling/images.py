"""Bodies across periodic sides: the grid is cut by each of them and by its images.

An image is the body a whole number of periods away. It cuts the grid as the body itself cuts the
grid displaced the other way.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.grid import Grid
from flowborne.kernels.arrays import Array, Integers


def periods(grid: Grid, sides: Boundaries) -> Array:
    """(3,) length of the domain along each periodic axis, else 0, m."""
    return grid.spacing * np.array(grid.shape) * np.array(sides.periodic())


def displaced(grid: Grid, sides: Boundaries, low: Array, high: Array) -> Iterator[Grid]:
    """The grid, displaced by whole periods, wherever something between two corners may reach it.

    What is as long as the period is cut off at the sides: it is endless, and has no images.

    low, high  (3,) m
    """
    period, origin = periods(grid, sides), np.array(grid.origin)
    ring = high - low < period
    if not ring.any():
        yield grid
        return
    home = np.floor((0.5 * (low + high) - origin)[ring] / period[ring])
    for image in product((-1, 0, 1), repeat=len(home)):
        moved = origin.copy()
        moved[ring] += period[ring] * (home + image)
        x, y, z = (float(place) for place in moved)
        yield replace(grid, origin=(x, y, z))


@dataclass(frozen=True)
class Images:
    """Which image of a body is met at a place.

    period  (3,) of the domain, m; 0 along axes that are not periodic
    middle  (n, 3) of the box around each body, then around each flesh, m
    """

    period: Array
    middle: Array

    def at_bodies(self, place: Array, body: Integers) -> Array:
        """(n, 3) places at the bodies themselves, m.

        place, body  (n, 3), (n,) places on the images of bodies, m, and which bodies
        """
        found = place.copy()
        for axis in np.flatnonzero(self.period):
            away = (place[:, axis] - self.middle[body, axis]) / self.period[axis]
            found[:, axis] -= self.period[axis] * np.round(away)
        return found
