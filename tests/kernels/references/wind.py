"""The kernels of `wind` in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Integers


def pushed_reference(
    body: Integers,
    centre: Array,
    normal: Array,
    area: Array,
    position: Array,
    rotation: Array,
    twist: Array,
    wind: Array,
) -> Array:
    """`pushed` in NumPy, patch by patch: F = |u.n| (u.n) A n at the patch's centre.

    centre, normal  (n, 3) in the frame of the patch's body
    the rest        as in `pushed`
    """
    x = position[body] + np.einsum("nij,nj->ni", rotation[body], centre)
    n = np.einsum("nij,nj->ni", rotation[body], normal)
    relative = wind - twist[body, :3] - np.cross(twist[body, 3:], x)
    inflow = np.einsum("ni,ni->n", relative, n)
    force = (np.abs(inflow) * inflow * area)[:, None] * n
    wrench = np.zeros((len(position), 6))
    np.add.at(wrench, body, np.concatenate([force, np.cross(x, force)], axis=1))
    return wrench
