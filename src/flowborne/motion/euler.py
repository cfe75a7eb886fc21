"""Rotations as the angles of a file: turns about coordinate axes, one after the other.

The angles (a, b, c) with the axes (i, j, k) stand for the rotation R_i(a) R_j(b) R_k(c).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from flowborne.quaternions import about, product

Array = NDArray[np.float64]

LOCKED = 1e-7
"""Cosine of the middle angle below which only the sum or difference of the others is known."""


def quaternions_of(angles: Array, axes: Array) -> Array:
    """(frames, 4) rotations of angles (frames, k) in degrees about unit axes (k, 3)."""
    result = np.tile([1.0, 0.0, 0.0, 0.0], (len(angles), 1))
    for column, axis in zip(np.deg2rad(angles).T, axes, strict=True):
        result = product(result, about(axis, column))
    return result


def angles_of(rotations: Array, order: tuple[int, int, int], start: Array) -> Array:
    """(frames, 3) angles in degrees, each frame's nearest to those of the frame before.

    rotations  (frames, 4) unit quaternions
    order      the axes, all different, of 0, 1, 2
    start      (3,) angles that the first frame's are nearest to; they also decide how a turn is
               shared between first and last angle where the middle one is at 90 degrees
    source     two triples of angles make one rotation: (a, b, c), (a + 180, 180 - b, c + 180)
    """
    i, j, k = order
    parity = 1.0 if (j - i) % 3 == 1 else -1.0
    R = Rotation.from_quat(rotations, scalar_first=True).as_matrix()
    cosine = np.hypot(R[:, i, i], R[:, i, j])
    first = np.arctan2(-parity * R[:, j, k], R[:, k, k])
    middle = np.arctan2(parity * R[:, i, k], cosine)
    last = np.arctan2(-parity * R[:, i, j], R[:, i, i])
    together = np.rad2deg(np.arctan2(parity * R[:, k, j], R[:, j, j]))
    angles = np.rad2deg(np.stack([first, middle, last], axis=-1))
    nearest = np.array(start)
    for frame, found in enumerate(angles):
        if cosine[frame] > LOCKED:
            both = np.stack([found, [found[0] + 180.0, 180.0 - found[1], found[2] + 180.0]])
        else:
            sense = parity * np.sign(found[1])
            change = _wrapped(together[frame] - nearest[0] - sense * nearest[2]) / 2.0
            both = nearest + np.array([[change, 0.0, sense * change]])
            both[:, 1] = found[1]
        steps = _wrapped(both - nearest)
        nearest = nearest + steps[np.argmin(np.sum(steps**2, axis=1))]
        angles[frame] = nearest
    return angles


def _wrapped(degrees: Array) -> Array:
    """From -180 to 180."""
    return (degrees + 180.0) % 360.0 - 180.0
