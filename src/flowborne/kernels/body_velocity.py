"""Velocity of bodies on the closed parts of faces."""

from __future__ import annotations

from numba import njit

from flowborne.kernels.arrays import Array, Integers


@njit(nogil=True, cache=True)
def add_body_velocity(
    out: Array,
    axis: int,
    axes: Integers,
    faces: Integers,
    bodies: Integers,
    closed: Array,
    place: Array,
    corner: Integers,
    weight: Array,
    twist: Array,
    flesh: Array,
) -> None:
    """Add closed fraction x body velocity on the faces across `axis`, at the centres of the parts.

    place           (n, 3) these centres at the bodies themselves, m
    corner, weight  (nf, 3) vertices that move the last nf parts
    twist, flesh    (nbody, 6) of the bodies, (n, 3) velocity of the vertices
    """
    flat_out = out.reshape(-1)
    rigid = axes.size - len(corner)
    for n in range(axes.size):
        if axes[n] != axis:
            continue
        f = faces[n]
        if n >= rigid:
            velocity = 0.0
            for c in range(3):
                velocity += weight[n - rigid, c] * flesh[corner[n - rigid, c], axis]
            flat_out[f] += closed[n] * velocity
            continue
        t, x, y, z = twist[bodies[n]], place[n, 0], place[n, 1], place[n, 2]
        if axis == 0:
            velocity = t[0] + t[4] * z - t[5] * y
        elif axis == 1:
            velocity = t[1] + t[5] * x - t[3] * z
        else:
            velocity = t[2] + t[3] * y - t[4] * x
        flat_out[f] += closed[n] * velocity
