"""Momenta about the world origin, and the impulse that their change makes."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Integers, Mask
from flowborne.kernels.jit import kernel


@kernel
def about_origin(vector: Array, moment: Array, centre: Array) -> Array:
    """(n, 6) vectors f, and their moments m + c x f about the world origin.

    vector, moment, centre  (n, 3) f, m about c, and c
    """
    screw = np.empty((len(vector), 6))
    for n in range(len(vector)):
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            screw[n, i] = vector[n, i]
            across = centre[n, j] * vector[n, k] - centre[n, k] * vector[n, j]
            screw[n, 3 + i] = moment[n, i] + across
    return screw


ROUNDING, OF_THE_WHOLE = 1e-14, 1e-15
"""Shares of the terms of an impulse, and of the largest impulse of all, that rounding may change: a
hand's forces are sums in which those of the whole creature cancel."""


Momenta = tuple[Array, Array, Integers]
"""(bodies, 6) of the subtree of each body, P and P+, about the world origin, N s and N m s; (nv,)
their rows for each dof."""


@kernel
def momentum_impulse(
    twist: Array,
    momenta: Momenta,
    conserved: Mask,
    gained: Array,
    still: Array,
    bias: Array,
    outer: Array,
    dt: float,
) -> tuple[Array, Array]:
    """(nv,) r of A v+ = r, and (nv,) how much of it may be rounding errors.

        r = A v + (M - armature) (v+ - v) + S.(P - P+) + dt f      along conserved dofs
        r = A v - dt c + dt f                                      along the others

    twist                       (nv, 6) S about the world origin, for unit velocity of each dof
    gained, still, bias, outer  (nv,) (M - armature) (v+ - v), A v, c, f
    """
    dofs, (given, later, body) = len(twist), momenta
    impulse, rounding, largest = np.empty(dofs), np.empty(dofs), 0.0
    for n in range(dofs):
        change, scale = 0.0, 0.0
        for i in range(6):
            before, after = given[body[n], i], later[body[n], i]
            change += twist[n, i] * (before - after)
            scale += abs(twist[n, i]) * (abs(before) + abs(after))
        moved = change + gained[n] if conserved[n] else -dt * bias[n]
        impulse[n] = still[n] + moved + dt * outer[n]
        rounding[n] = ROUNDING * (scale + dt * abs(outer[n]))
        largest = max(largest, scale)
    for n in range(dofs):
        rounding[n] += OF_THE_WHOLE * largest
    return impulse, rounding
