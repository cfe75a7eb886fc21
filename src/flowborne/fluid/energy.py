"""Advection makes no energy: MacCormack's correction is taken back as far as it would."""

from __future__ import annotations

import numpy as np

from flowborne.fluid.grid import Array, Faces
from flowborne.kernels.jit import njit


@njit(nogil=True, cache=True)
def weighted(m: Array, a: Array, b: Array) -> float:
    """Sum of m a b."""
    total = 0.0
    for n in range(m.size):
        total += m.flat[n] * a.flat[n] * b.flat[n]
    return total


@njit(nogil=True, cache=True)
def towards(u: Array, w: Array, share: float) -> None:
    """u + share (w - u), in place."""
    for n in range(u.size):
        u.flat[n] += share * (w.flat[n] - u.flat[n])


def energy(velocity: Faces, mass: Faces) -> float:
    """Kinetic energy of the velocity on faces with these masses (kg), J."""
    return 0.5 * product(mass, velocity, velocity)


def product(mass: Faces, a: Faces, b: Faces) -> float:
    """Sum of mass a b over all faces."""
    return sum(float(weighted(*three)) for three in zip(mass, a, b, strict=True))


def without_gain(carried: Faces, plain: Faces, mass: Faces, most: float) -> float:
    """Move a carried velocity towards the plain semi-Lagrangian one, in place, to an energy bound.

    MacCormack's scheme hardly dissipates, and in three dimensions a flow that is not resolved down
    to its smallest eddies then gains energy out of nothing, without end. The blend u + s (w - u) of
    both schemes holds the bound with the least s; its energy is a parabola in s.

    carried  Faces u, m/s, after the correction
    plain    Faces w, before it
    mass     of the faces, kg
    most     J
    returns  s, from 0 to 1; 1 also where even the plain scheme is above the bound
    """
    both = product(mass, carried, carried)
    excess = 0.5 * both - most
    if excess <= 0.0:
        return 0.0
    across = product(mass, carried, plain)
    # excess + slope s + curve s^2 / 2 = 0
    slope, curve = across - both, product(mass, plain, plain) - 2.0 * across + both
    root = slope * slope - 2.0 * curve * excess
    share = 1.0
    if slope < 0.0 and root >= 0.0:
        share = min(2.0 * excess / (-slope + float(np.sqrt(root))), 1.0)
    for u, w in zip(carried, plain, strict=True):
        towards(u, w, share)
    return share
