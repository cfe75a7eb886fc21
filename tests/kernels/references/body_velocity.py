"""The kernels of `body_velocity` in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Integers


def body_velocity_reference(
    place: Array,
    axis: Integers,
    bodies: Integers,
    corner: Integers,
    weight: Array,
    twist: Array,
    flesh: Array,
) -> Array:
    """(n,) velocity along its face's axis of what closes each part, as `add_body_velocity` has it.

    place  (n, 3) centres of the faces, m
    """
    rigid = axis.size - len(corner)
    t = twist[bodies[:rigid]]
    velocity = t[:, :3] + np.cross(t[:, 3:], place[:rigid])
    skin = np.einsum("nc,ncd->nd", weight, flesh[corner])
    return np.asarray(np.concatenate([velocity, skin])[np.arange(axis.size), axis])
