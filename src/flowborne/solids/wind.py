"""Simple winds: forces on the bodies without a simulated fluid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from flowborne.kernels.arrays import Array
from flowborne.kernels.wind import places, pushed
from flowborne.solids.dynamics import Kinematics
from flowborne.solids.model import SolidModel
from flowborne.solids.scratch import cross
from flowborne.solids.surfaces import surfaces


class Wind(Protocol):
    """An external force on the bodies."""

    def wrench(self, model: SolidModel, kinematics: Kinematics, v: Array, time: float) -> Array:
        """(nbody, 6) force (N) and torque about the world origin (N m) on each body.

        v     (nv,) generalised velocity
        time  s
        """
        ...


class WindField(Protocol):
    """A wind that varies in space and time; picklable."""

    def __call__(self, x: Array, time: float) -> Array:
        """(n, 3) velocity in m/s at the points x (n, 3)."""
        ...


@dataclass(frozen=True)
class WindFaces:
    """The simple wind force on every face, eq. (2): F = sign(u.n) A rho (u.n)^2 n.

    u is the wind relative to the face, n its outward normal. Every face counts, windward and
    leeward, as in the paper: the force on a thin plate across the wind is 2 rho U^2 per area.
    Integers do not shelter each other.

    velocity  (3,) m/s, or a field in space and time
    density   rho, kg/m^3 (per unit depth in a slab)
    bodies    names of the bodies with this force; all when None
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
        return _on_bodies(model, self.density * wrench, self.bodies)

    def on_flesh(self, model: SolidModel, pose: Kinematics, v: Array, time: float) -> Array:
        """(n, 3) force on each vertex of flesh, N: a third of that on each triangle of its skin.

        Of flesh that other bodies carry too, the chosen bodies have their share of the force.
        """
        assert model.flesh is not None
        faces, velocity = model.flesh.surface, (pose.vertex_jacobian @ v).reshape(-1, 3)
        a, b, c = np.moveaxis(pose.vertices[faces], 1, 0)
        across = 0.5 * cross(b - a, c - a)  # area times normal
        area = np.maximum(np.linalg.norm(across, axis=1), np.finfo(float).tiny)
        wind = self.velocity
        blowing = wind((a + b + c) / 3.0, time) if callable(wind) else np.array(wind)
        inflow = ((blowing - velocity[faces].mean(axis=1)) * across).sum(axis=1)
        third = self.density * (np.abs(inflow) * inflow / area**2)[:, None] * across / 3.0
        force = np.zeros_like(pose.vertices)
        np.add.at(force, faces, third[:, None])
        if self.bodies is not None:
            chosen = [model.body(name) for name in self.bodies]
            force *= model.flesh.carried[:, chosen].sum(axis=1, keepdims=True)
        return force


@dataclass(frozen=True)
class WindForce:
    """The same force on each body, at its centre of mass: the wind of Fig. 4.

    force   (3,) N (N/m in a slab)
    bodies  names of the bodies with this force; all when None
    """

    force: tuple[float, float, float]
    bodies: tuple[str, ...] | None = None

    def wrench(self, model: SolidModel, kinematics: Kinematics, v: Array, time: float) -> Array:
        """(nbody, 6) force and torque about the world origin on each body."""
        force = np.tile(np.asarray(self.force, dtype=np.float64), (model.nbody, 1))
        wrench = np.concatenate([force, cross(kinematics.mass_centre, force)], axis=1)
        wrench[0] = 0.0
        return _on_bodies(model, wrench, self.bodies)


def _on_bodies(model: SolidModel, wrench: Array, bodies: tuple[str, ...] | None) -> Array:
    """The wrenches of the named bodies. Raises ValueError for an unknown name."""
    if bodies is None:
        return wrench
    chosen = np.zeros(model.nbody, bool)
    chosen[[model.body(name) for name in bodies]] = True
    return np.where(chosen[:, None], wrench, 0.0)
