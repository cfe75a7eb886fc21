"""Advection makes no energy: MacCormack's correction is taken back as far as it would."""

from __future__ import annotations

import numpy as np

from flowborne.fluid.grid import Array, Faces


def energy(velocity: Faces, mass: Faces) -> float:
    """Kinetic energy of the velocity on faces with these masses (kg), J."""
    return 0.5 * sum(float(np.vdot(m, u * u)) for u, m in zip(velocity, mass, strict=True))


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
    excess = energy(carried, mass) - most
    if excess <= 0.0:
        return 0.0
    change: list[Array] = [w - u for w, u in zip(plain, carried, strict=True)]
    slope = sum(float(np.vdot(m, u * d)) for m, u, d in zip(mass, carried, change, strict=True))
    curve = sum(float(np.vdot(m, d * d)) for m, d in zip(mass, change, strict=True))
    # excess + slope s + curve s^2 / 2 = 0
    root = slope * slope - 2.0 * curve * excess
    share = 1.0
    if slope < 0.0 and root >= 0.0:
        share = min(2.0 * excess / (-slope + np.sqrt(root)), 1.0)
    for u, d in zip(carried, change, strict=True):
        u += share * d
    return share
