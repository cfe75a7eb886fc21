"""Momenta about the world origin, and the impulse that their change makes."""

from __future__ import annotations

import numpy as np
from numba import njit

from flowborne.kernels.arrays import Array, Integers, Mask


@njit(nogil=True, cache=True)
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


@njit(nogil=True, cache=True)
def momentum_impulse(
    cdof: Array,
    centre: Array,
    given: Array,
    later: Array,
    body: Integers,
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

    cdof, centre                (nv, 6), (nv, 3) of the twists S about the world origin
    given, later, body          (bodies, 6) P and P+, and (nv,) their rows for each dof
    gained, still, bias, outer  (nv,) (M - armature) (v+ - v), A v, c, f
    """
    dofs = len(cdof)
    impulse, rounding, largest = np.empty(dofs), np.empty(dofs), 0.0
    twist = np.empty(6)
    for n in range(dofs):
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            across = centre[n, j] * cdof[n, k] - centre[n, k] * cdof[n, j]
            twist[i], twist[3 + i] = cdof[n, 3 + i] + across, cdof[n, i]
        change, scale = 0.0, 0.0
        for i in range(6):
            before, after = given[body[n], i], later[body[n], i]
            change += twist[i] * (before - after)
            scale += abs(twist[i]) * (abs(before) + abs(after))
        moved = change + gained[n] if conserved[n] else -dt * bias[n]
        impulse[n] = still[n] + moved + dt * outer[n]
        rounding[n] = ROUNDING * (scale + dt * abs(outer[n]))
        largest = max(largest, scale)
    for n in range(dofs):
        rounding[n] += OF_THE_WHOLE * largest
    return impulse, rounding
