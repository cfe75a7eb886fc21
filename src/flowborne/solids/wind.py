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
        if callable(self.velocity):
            wind = self.velocity(places(patches.body, patches.centre, *pose), time)
        else:
            wind = np.array([self.velocity])
        twist = kinematics.twist_jacobian @ v
        wrench = pushed(patches.body, patches.screw, patches.area, *pose, twist, wind)
        return _only(model, self.density * wrench, self.bodies)


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
    screw: Array,
    area: Array,
    position: Array,
    rotation: Array,
    twist: Array,
    wind: Array,
) -> Array:
    """(nbody, 6) eq. (2) for unit density: force and torque about the world origin on each body.

    In a body's frame the wind meets a patch with G.(u, -omega), u being its velocity relative to
    the frame's origin and G = (n, c x n); the patch passes on A |G.(u, -omega)| G.(u, -omega) G.

    body, screw, area          of the patches (`Patches`)
    position, rotation, twist  (nbody, 3), (nbody, 3, 3), (nbody, 6) of the bodies
    wind                       (n, 3) m/s at each patch, or (1, 3) for all
    """
    wrench, force, torque = np.zeros((len(position), 6)), np.empty(3), np.empty(3)
    first = 0
    while first < len(body):
        b, R, x = body[first], rotation[body[first]], position[body[first]]
        v = twist[b, :3] + np.cross(twist[b, 3:], x)
        spin = -R.T @ twist[b, 3:]
        p, q, r = spin[0], spin[1], spin[2]
        X = Y = Z = K = M = N = 0.0  # in registers, where a small array would not be
        n = first
        while n < len(body) and body[n] == b:
            if n == first or len(wind) > 1:
                flow = R.T @ (wind[n if len(wind) > 1 else 0] - v)
                u, s, w = flow[0], flow[1], flow[2]
            G = screw[n]
            inflow = G[0] * u + G[1] * s + G[2] * w + G[3] * p + G[4] * q + G[5] * r
            passed = area[n] * abs(inflow) * inflow
            X, Y, Z = X + passed * G[0], Y + passed * G[1], Z + passed * G[2]
            K, M, N = K + passed * G[3], M + passed * G[4], N + passed * G[5]
            n += 1
        force[0], force[1], force[2] = X, Y, Z
        torque[0], torque[1], torque[2] = K, M, N
        wrench[b, :3] = R @ force
        wrench[b, 3:] = R @ torque + np.cross(x, wrench[b, :3])
        first = n
    return wrench


def _only(model: SolidModel, wrench: Array, bodies: tuple[str, ...] | None) -> Array:
    """The wrenches of the named bodies. Raises ValueError for a name that is not in the model."""
    if bodies is None:
        return wrench
    chosen = np.zeros(model.nbody, bool)
    chosen[[model.body(name) for name in bodies]] = True
    return np.where(chosen[:, None], wrench, 0.0)
