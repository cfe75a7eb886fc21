"""Simple winds: forces on the bodies without a simulated fluid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numba import njit
from numpy.typing import NDArray

from flowborne.solids.dynamics import Kinematics
from flowborne.solids.model import SolidModel
from flowborne.solids.momentum import cross
from flowborne.solids.surfaces import surfaces

Array = NDArray[np.float64]
Bodies = NDArray[np.int64]


class Wind(Protocol):
    """What pushes the bodies from outside."""

    def wrench(self, model: SolidModel, kinematics: Kinematics, v: Array, time: float) -> Array:
        """(nbody, 6) force (N) and torque about the world origin (N m) on each body.

        v     (nv,) generalised velocity
        time  s
        """
        ...


class WindField(Protocol):
    """A wind that differs from place to place; picklable."""

    def __call__(self, x: Array, time: float) -> Array:
        """(n, 3) velocity in m/s at the places x (n, 3)."""
        ...


@dataclass(frozen=True)
class WindFaces:
    """The simple wind force on every face, eq. (2): F = sign(u.n) A rho (u.n)^2 n.

    u is the wind relative to the face, n its outward normal. Every face counts, windward and
    leeward, as in the paper: a thin plate across the wind feels 2 rho U^2 per area. Nothing
    shelters anything.

    velocity  (3,) m/s, or a field of place and time
    density   rho, kg/m^3 (per unit depth in a slab)
    bodies    names of the bodies that it blows on; all when None
    source    Lentine et al. 2011, eq. (2)
    """

    velocity: tuple[float, float, float] | WindField
    density: float
    bodies: tuple[str, ...] | None = None

    def wrench(self, model: SolidModel, kinematics: Kinematics, v: Array, time: float) -> Array:
        """(nbody, 6) force and torque about the world origin on each body."""
        patches = surfaces(model)
        pose = kinematics.body_position, kinematics.body_rotation
        wind = (
            np.array([self.velocity])
            if not callable(self.velocity)
            else self.velocity(places(patches.body, patches.centre, *pose), time)
        )
        twist = kinematics.twist_jacobian @ v
        wrench = self.density * pushed(
            patches.body, patches.centre, patches.normal, patches.area, *pose, twist, wind
        )
        return _only(model, wrench, self.bodies)


@dataclass(frozen=True)
class WindForce:
    """The same force on each body, at its centre of mass: the wind of Fig. 4.

    force   (3,) N (N/m in a slab)
    bodies  names of the bodies that it pushes; all when None
    """

    force: tuple[float, float, float]
    bodies: tuple[str, ...] | None = None

    def wrench(self, model: SolidModel, kinematics: Kinematics, v: Array, time: float) -> Array:
        """(nbody, 6) force and torque about the world origin on each body."""
        force = np.tile(np.asarray(self.force, dtype=np.float64), (model.nbody, 1))
        wrench = np.concatenate([force, cross(kinematics.mass_centre, force)], axis=1)
        wrench[0] = 0.0
        return _only(model, wrench, self.bodies)


@njit(nogil=True, cache=True)
def places(body: Bodies, centre: Array, position: Array, rotation: Array) -> Array:
    """(n, 3) patches' centres in the world: position + rotation centre."""
    x = np.empty_like(centre)
    for n in range(len(body)):
        for i in range(3):
            x[n, i] = position[body[n], i]
            for j in range(3):
                x[n, i] += rotation[body[n], i, j] * centre[n, j]
    return x


@njit(nogil=True, cache=True)
def pushed(
    body: Bodies,
    centre: Array,
    normal: Array,
    area: Array,
    position: Array,
    rotation: Array,
    twist: Array,
    wind: Array,
) -> Array:
    """(nbody, 6) eq. (2) for unit density: the sum over each body's patches of f and x cross f with

        f = sign(u.n) A (u.n)^2 n        u = wind - v - omega cross x

    in the world, patches being given in their bodies' frames (`Patches`).

    position, rotation, twist  (nbody, 3), (nbody, 3, 3), (nbody, 6) of the bodies
    wind                       (n, 3) m/s at each patch, or (1, 3) for all
    """
    wrench = np.zeros((len(position), 6))
    x, out, f = np.empty(3), np.empty(3), np.empty(3)
    for n in range(len(body)):
        b = body[n]
        w = wind[n if len(wind) > 1 else 0]
        for i in range(3):
            x[i], out[i] = position[b, i], 0.0
            for j in range(3):
                x[i] += rotation[b, i, j] * centre[n, j]
                out[i] += rotation[b, i, j] * normal[n, j]
        v, omega = twist[b, :3], twist[b, 3:]
        inflow = 0.0
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            inflow += (w[i] - v[i] - omega[j] * x[k] + omega[k] * x[j]) * out[i]
        for i in range(3):
            f[i] = area[n] * inflow * abs(inflow) * out[i]
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            wrench[b, i] += f[i]
            wrench[b, 3 + i] += x[j] * f[k] - x[k] * f[j]
    return wrench


def _only(model: SolidModel, wrench: Array, bodies: tuple[str, ...] | None) -> Array:
    """The wrenches of the named bodies. Raises ValueError for a name that is not in the model."""
    if bodies is None:
        return wrench
    chosen = np.zeros(model.nbody, bool)
    chosen[[model.body(name) for name in bodies]] = True
    return np.where(chosen[:, None], wrench, 0.0)
