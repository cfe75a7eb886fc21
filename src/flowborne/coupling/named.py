"""Bodies and joints of a world by their names, each with everything that is known of it.

Positions and velocities hold at one instant. The force of the step that ended there changes the
velocity from half a step before to half a step after, so it holds at that instant too; the velocity
is the mean of both. Read half a step off, a force in phase with an acceleration seems to damp.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from flowborne.coupling.world import World
from flowborne.kernels.arrays import Array
from flowborne.solids.dynamics import Kinematics, kinematics
from flowborne.solids.model import SolidModel


class Report(Protocol):
    """What a step, or a frame, says of bodies and joints; see `StepReport`."""

    @property
    def velocity(self) -> Array:
        """(nv,) at its end."""
        ...

    @property
    def acceleration(self) -> Array:
        """(nv,) change of v in its last step by dt."""
        ...

    @property
    def dt(self) -> float:
        """Length of that step, s."""
        ...

    @property
    def actuator(self) -> Array:
        """(nv,)"""
        ...

    def central_wrench(self) -> Array:
        """(nbody, 6) of fluid and winds, about the bodies' centres of mass."""
        ...

    def central_added_mass(self) -> Array:
        """(nbody, 6) the part of it that resists the bodies' acceleration."""
        ...


@dataclass(frozen=True, eq=False)
class Sensed:
    """What a step or frame says of bodies and joints, kept for a checkpoint; see `Report`."""

    velocity: Array
    acceleration: Array
    dt: float
    actuator: Array
    wrench: Array
    added_mass: Array

    @classmethod
    def of(cls, report: Report) -> Sensed:
        wrench, added = report.central_wrench(), report.central_added_mass()
        state = report.velocity, report.acceleration, report.dt
        return cls(*state, report.actuator, wrench, added)

    @classmethod
    def from_arrays(cls, arrays: dict[str, Array]) -> Sensed:
        """Those that its attributes were saved as."""
        return cls(**arrays | {"dt": float(arrays["dt"])})  # type: ignore[arg-type]

    def central_wrench(self) -> Array:
        return self.wrench

    def central_added_mass(self) -> Array:
        return self.added_mass


@dataclass(frozen=True, eq=False)
class BodyState:
    """A body after a step, in world axes; what only a step can tell is nan before the first.

    position          (3,) origin of its frame, m
    rotation          (3, 3), columns are its axes
    centre            (3,) its centre of mass, m
    velocity          (3,) of its centre of mass, m/s
    angular_velocity  (3,) rad/s
    acceleration      (3,) of its centre of mass, m/s^2: change of its velocity from half a step
                      before to half a step after, by the step
    angular_acceleration
                      (3,) rad/s^2
    force             (3,) of fluid and winds, N (N/m in a slab)
    torque            (3,) of the same about its centre of mass, N m
    added_mass_force  (3,) the part of `force` with which the fluid resists acceleration.
                      The rest acts on bodies that keep their velocities. nan in trials
    added_mass_torque (3,) the same part of `torque`
    """

    position: Array
    rotation: Array
    centre: Array
    velocity: Array
    angular_velocity: Array
    acceleration: Array
    angular_acceleration: Array
    force: Array
    torque: Array
    added_mass_force: Array
    added_mass_torque: Array


@dataclass(frozen=True, eq=False)
class JointState:
    """A joint after a step; what only a step can tell is nan before the first.

    position  (k,) rad or m; a quaternion (w, x, y, z) of a ball; of a free joint metres, then one
    velocity  (m,) rad/s or m/s
    drive     (m,) torque (N m) or force (N) of its drive, per m in a slab
    """

    position: Array
    velocity: Array
    drive: Array


class Named:
    """The bodies and joints of a world by their names.

    model   whose they are
    q       (nq,) positions
    report  of the step that led there; None before the first
    """

    def __init__(self, model: SolidModel, q: Array, report: Report | None) -> None:
        self._model, self._q, self._report = model, q, report

    @classmethod
    def after(cls, world: World, report: Report | None) -> Named:
        """Those of a world after the step of `report`."""
        return cls(world.setup.solid, world.solid.q, report)

    def body(self, name: str) -> BodyState:
        """A body's state. Raises ValueError for an unknown name."""
        pose, body, report = self._pose, self._model.body(name), self._report
        place = pose.body_position[body], pose.body_rotation[body], pose.mass_centre[body]
        if report is None:
            return BodyState(*place, *[np.full(3, np.nan)] * 8)
        velocity = central_twist(pose, report.velocity, body)
        before, after = (central_twist(*half, body) for half in self._halves)
        wrench, added = report.central_wrench()[body], report.central_added_mass()[body]
        sixes = velocity, (after - before) / report.dt, wrench, added
        return BodyState(*place, *(half for six in sixes for half in np.split(six, 2)))

    def joint(self, name: str) -> JointState:
        """A joint's state. Raises ValueError for an unknown name."""
        dofs = self._model.dofs_of(name)
        position = self._q[self._model.positions_of(name)]
        if self._report is None:
            nothing = np.full(dofs.size, np.nan)
            return JointState(position, nothing, nothing)
        return JointState(position, self._report.velocity[dofs], self._report.actuator[dofs])

    @cached_property
    def _pose(self) -> Kinematics:
        return kinematics(self._model, self._q)

    @cached_property
    def _halves(self) -> tuple[tuple[Kinematics, Array], tuple[Kinematics, Array]]:
        """Poses half a step before and after, and the velocities (nv,) there."""
        assert self._report is not None
        half, report = 0.5 * self._report.dt, self._report
        before, after = (report.velocity + sign * half * report.acceleration for sign in (-1, 1))
        ends = (-half, before), (half, after)
        first, last = (self._model.integrate(self._q, v, dt) for dt, v in ends)
        return (kinematics(self._model, first), before), (kinematics(self._model, last), after)


def central_twist(pose: Kinematics, velocity: Array, body: int) -> Array:
    """(6,) velocity of a body's centre of mass, and its angular velocity."""
    twist = pose.twist_jacobian[body] @ velocity
    return np.append(twist[:3] + np.cross(twist[3:], pose.mass_centre[body]), twist[3:])
