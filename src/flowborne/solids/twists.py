"""Twists of dofs about the world origin."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flowborne.kernels.momentum import about_origin

Array = NDArray[np.float64]


def cross(a: Array, b: Array) -> Array:
    """(k, 3) vector products of rows; np.cross takes ten times as long for few rows."""
    product = np.empty((len(b), 3))
    product[:, 0] = a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1]
    product[:, 1] = a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2]
    product[:, 2] = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return product


def twists_about_origin(cdof: Array, centre: Array) -> Array:
    """(nv, 6) velocity of the point at the world origin, and angular velocity, of unit velocity of
    each dof.

    cdof    (nv, 6) angular velocity, and velocity of the point at `centre`
    centre  (nv, 3) m
    """
    turn, speed = np.ascontiguousarray(cdof[:, :3]), np.ascontiguousarray(cdof[:, 3:])
    return np.concatenate([about_origin(turn, speed, centre)[:, 3:], turn], axis=1)
