"""Bodies and joints of a world by their names, each with everything that is known of it.

All of it holds at one instant, that of the positions. The force is that of the step which ended
there and changes the velocity from half a step before to half a step after; the velocity is the
mean of both. Read half a step off, a force in phase with an acceleration seems to damp.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flowborne.coupling.report import StepReport
from flowborne.coupling.world import World
from flowborne.solids.dynamics import Kinematics, kinematics
from flowborne.solids.model import SolidModel

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class BodyState:
    """A body after a step, in world axes; what only a step can tell is nan before the first.

    position          (3,) origin of its frame, m
    rotation          (3, 3), columns are its axes
    centre            (3,) its centre of mass, m
    velocity          (3,) of its centre of mass, m/s
    angular_velocity  (3,) rad/s
    force             (3,) of fluid and winds, N (N/m in a slab)
    torque            (3,) of the same about its centre of mass, N m
    """

    position: Array
    rotation: Array
    centre: Array
    velocity: Array
    angular_velocity: Array
    force: Array
    torque: Array

    @classmethod
    def of(cls, pose: Kinematics, body: int, report: StepReport | None) -> BodyState:
        """The body of this number in a pose to which the step of `report` led."""
        position, rotation = pose.body_position[body], pose.body_rotation[body]
        centre = pose.mass_centre[body]
        if report is None:
            nothing = np.full(3, np.nan)
            return cls(position, rotation, centre, nothing, nothing, nothing, nothing)
        twist = pose.twist_jacobian[body] @ report.velocity
        velocity = twist[:3] + np.cross(twist[3:], centre)
        force, torque = np.split(report.fluid_wrench()[body], 2)
        torque = torque - np.cross(centre, force)
        return cls(position, rotation, centre, velocity, twist[3:], force, torque)


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

    def __init__(self, model: SolidModel, q: Array, report: StepReport | None) -> None:
        self._model, self._q, self._report = model, q, report
        self._pose: Kinematics | None = None

    @classmethod
    def after(cls, world: World, report: StepReport | None) -> Named:
        """Those of a world after the step of `report`."""
        return cls(world.setup.solid, world.solid.q, report)

    def body(self, name: str) -> BodyState:
        """A body's state. Raises ValueError for an unknown name."""
        if self._pose is None:
            self._pose = kinematics(self._model, self._q)
        return BodyState.of(self._pose, self._model.body(name), self._report)

    def joint(self, name: str) -> JointState:
        """A joint's state. Raises ValueError for an unknown name."""
        dofs = self._model.dofs_of(name)
        position = self._q[self._model.positions_of(name)]
        if self._report is None:
            nothing = np.full(dofs.size, np.nan)
            return JointState(position, nothing, nothing)
        return JointState(position, self._report.velocity[dofs], self._report.actuator[dofs])
