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
    corner: Integers,
    weight: Array,
    twist: Array,
    flesh: Array,
    origin: Array,
    h: float,
    flat: bool,
) -> None:
    """Add closed fraction x body velocity on the faces across `axis`, at their centres.

    corner, weight  (nf, 3) vertices that move the last nf parts
    twist, flesh    (nbody, 6) of the bodies, (n, 3) velocity of the vertices
    """
    n1, n2 = out.shape[1], out.shape[2]
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
        i, j, k = f // (n1 * n2), (f // n2) % n1, f % n2
        x = origin[0] + h * (i + (0.0 if axis == 0 else 0.5))
        y = origin[1] + h * (j + (0.0 if axis == 1 else 0.5))
        z = 0.0 if flat else origin[2] + h * (k + (0.0 if axis == 2 else 0.5))
        t = twist[bodies[n]]
        if axis == 0:
            velocity = t[0] + t[4] * z - t[5] * y
        elif axis == 1:
            velocity = t[1] + t[5] * x - t[3] * z
        else:
            velocity = t[2] + t[3] * y - t[4] * x
        flat_out[f] += closed[n] * velocity
