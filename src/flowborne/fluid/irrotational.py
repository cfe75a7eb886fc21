"""Tangential velocity of fluid without vorticity beyond a side.

Where there is none, the tangential component changes across the side as the normal one does along
it, du_t/dx_n = du_n/dx_t: so the circulation around each node (in rooms: each edge) of the side
is 0.
"""

from __future__ import annotations

import numpy as np

from flowborne.fluid.grid import Array
from flowborne.fluid.sides.side import Place


def tangential_change(normal: Array, place: Place, component: int, periodic: bool) -> Array:
    """What a tangential component has more one cell beyond the side than in the layer inside it,
    m/s.

    normal    velocity across the side on its faces, m/s
    periodic  whether the side is joined to itself along the component's axis
    returns   like the layer of the component's faces at the side; at both ends, where a face of
              the side is missing, as next to them
    """
    steps = np.diff(normal, axis=component)
    if periodic:
        around = np.take(normal, [0], component) - np.take(normal, [-1], component)
        steps = np.concatenate([around, steps, around], axis=component)
    else:
        wide = [(int(axis == component),) * 2 for axis in range(3)]
        steps = np.pad(steps, wide, mode="edge")
    return steps if place.upper else -steps


def comes_in(normal: Array, place: Place, component: int, periodic: bool) -> Array:
    """Whether fluid comes in through the side, where a tangential component lives: 1 or 0, of the
    same shape as `tangential_change`."""
    wide = [(int(axis == component),) * 2 for axis in range(3)]
    wrapped = np.pad(normal, wide, mode="wrap" if periodic else "edge")
    low, high = (np.delete(wrapped, end, component) for end in (-1, 0))
    inward = -(low + high) if place.upper else low + high
    return np.asarray(inward > 0.0, np.float64)
