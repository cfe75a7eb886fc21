"""Bodies and joints by their names, each with everything that is known of it.

Positions and velocities hold at one instant. The force of the step that ended there changes the
velocity from half a step before to half a step after, so it holds at that instant too; the velocity
is the mean of both. Read half a step off, a force in phase with an acceleration seems to damp.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, partial

import numpy as np

from flowborne.base.one_line import one_line
from flowborne.kernels.arrays import Array
from flowborne.solids.dynamics import Kinematics, kinematics
from flowborne.solids.model import SolidModel
from flowborne.solids.scratch import cross


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
    added_mass        gives (6,) the part of force and torque with which the fluid resists
                      acceleration, solved for when it is first asked for
    """

    __repr__ = one_line

    position: Array
    rotation: Array
    centre: Array
    velocity: Array
    angular_velocity: Array
    acceleration: Array
    angular_acceleration: Array
    force: Array
    torque: Array
    added_mass: Callable[[], Array] = field(repr=False, kw_only=True)

    @property
    def added_mass_force(self) -> Array:
        """(3,) the part of `force` with which the fluid resists acceleration, N. The rest acts on
        bodies that keep their velocities. nan in trials."""
        return self.added_mass()[:3]

    @property
    def added_mass_torque(self) -> Array:
        """(3,) the same part of `torque`, N m."""
        return self.added_mass()[3:]


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


@dataclass(frozen=True, eq=False)
class ActuatorState:
    """An actuator of the model after a step; nan before the first.

    force       (k,) N or N m, positive where it lengthens; one number, three of a ball joint
    activation  (m,) of a muscle or filter; empty without
    """

    force: Array
    activation: Array


@dataclass(frozen=True, eq=False)
class Sensed:
    """What can be sensed of bodies and joints at the end of a step or a frame.

    model         whose they are
    q             (nq,) positions
    velocity      (nv,); nan before the first step, as is all else
    acceleration  (nv,) change of v in the last step by dt
    dt            s, length of that step
    actuator      (nv,) generalised force of the drives in that step, N or N m
    wrench        (nbody, 6) of fluid and winds, about the bodies' centres of mass
    added_mass    gives (nbody, 6) the part of it that resists the bodies' acceleration
    output        (n,) forces of the model's actuators in that step, N or N m
    """

    model: SolidModel
    q: Array
    velocity: Array
    acceleration: Array
    dt: float
    actuator: Array
    wrench: Array
    added_mass: Callable[[], Array]
    output: Array = field(default_factory=partial(np.zeros, 0))

    @classmethod
    def before_steps(cls, model: SolidModel, q: Array) -> Sensed:
        """Of the start, where only positions are known."""
        drives, wrench = np.full(model.nv, np.nan), np.full((model.nbody, 6), np.nan)
        output = np.full(model.outputs, np.nan)
        return cls(model, q, drives, drives, np.nan, drives, wrench, lambda: wrench, output)

    def arrays(self) -> dict[str, Array]:
        """What a step told, as named arrays; none before the first."""
        if np.isnan(self.dt):
            return {}
        named = {name: np.asarray(getattr(self, name)) for name in OF_STEP}
        if self.output.size:
            named["output"] = self.output
        return named | {"added_mass": self.added_mass()}

    @classmethod
    def from_arrays(cls, model: SolidModel, q: Array, arrays: dict[str, Array]) -> Sensed:
        """The way back."""
        told = {name: arrays[name] for name in OF_STEP} | {"dt": float(arrays["dt"])}
        added, output = arrays["added_mass"], arrays.get("output", np.zeros(model.outputs))
        return cls(model, q, **told, added_mass=lambda: added, output=output)  # type: ignore[arg-type]

    def body(self, name: str) -> BodyState:
        """A body's state. Raises ValueError for an unknown name."""
        pose, body = self.pose, self.model.body(name)
        velocity = central_twist(pose, self.velocity, body)
        before, after = (central_twist(*half, body) for half in self._halves)
        sixes = velocity, (after - before) / self.dt, self.wrench[body]
        place = pose.body_position[body], pose.body_rotation[body], pose.mass_centre[body]
        halves = (half for six in sixes for half in np.split(six, 2))
        return BodyState(*place, *halves, added_mass=lambda: self.added_mass()[body])

    def joint(self, name: str) -> JointState:
        """A joint's state. Raises ValueError for an unknown name."""
        dofs, position = self.model.dofs_of(name), self.q[self.model.positions_of(name)]
        return JointState(position, self.velocity[dofs], self.actuator[dofs])

    @cached_property
    def pose(self) -> Kinematics:
        return kinematics(self.model, self.q)

    @cached_property
    def _halves(self) -> tuple[tuple[Kinematics, Array], tuple[Kinematics, Array]]:
        """Poses half a step before and after, and the velocities (nv,) there."""
        if np.isnan(self.dt):
            return (self.pose, self.velocity), (self.pose, self.velocity)
        half = 0.5 * self.dt
        before, after = (self.velocity + sign * half * self.acceleration for sign in (-1, 1))
        ends = (-half, before), (half, after)
        first, last = (self.model.integrate(self.q, v, dt) for dt, v in ends)
        return (kinematics(self.model, first), before), (kinematics(self.model, last), after)


OF_STEP = ("velocity", "acceleration", "dt", "actuator", "wrench")
"""What a step tells besides the added mass, in the order of a checkpoint."""


def central_twist(pose: Kinematics, velocity: Array, body: int) -> Array:
    """(6,) velocity of a body's centre of mass, and its angular velocity."""
    twist = pose.twist_jacobian[body] @ velocity
    return np.append(twist[:3] + cross(twist[3:], pose.mass_centre[body]), twist[3:])
