"""The input of an objective: a world after a step, and the report of the step."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from flowborne.control import creature
from flowborne.coupling.report import StepReport
from flowborne.kernels.arrays import Array, Integers
from flowborne.solids.dynamics import Kinematics, kinematics
from flowborne.solids.momentum import momentum
from flowborne.solids.sensed import BodyState, JointState, Sensed

if TYPE_CHECKING:
    from flowborne.coupling.world import World


@dataclass(frozen=True)
class Measurement:
    """A world after a step, real or hypothetical.

    `body("head").velocity` and `joint("leg_1").position` give the quantities of a body or a joint
    by name, in SI units; see `BodyState` and `JointState`.

    world   the state after the step
    report  of the step
    now     s, time for phases: that of the decision. None: that of the world
    """

    world: World
    report: StepReport
    now: float | None = None

    @property
    def dt(self) -> float:
        """Length of the measured step, s."""
        return self.report.dt

    @property
    def phase_time(self) -> float:
        """Time at which phases are looked up, s."""
        return self.world.time if self.now is None else self.now

    @property
    def time(self) -> float:
        """s since the start, after the step."""
        return self.world.time

    @cached_property
    def _pose(self) -> Kinematics:
        return kinematics(self.world.setup.solid, self.world.solid.q)

    @cached_property
    def _sensed(self) -> Sensed:
        return self.report.sensed(self.world)

    def body(self, name: str) -> BodyState:
        """The state of a body. Raises ValueError for an unknown name."""
        return self._sensed.body(name)

    def joint(self, name: str) -> JointState:
        """The state of a joint. Raises ValueError for an unknown name."""
        return self._sensed.joint(name)

    def joint_positions(self, dofs: Integers) -> Array:
        """(k,) positions of scalar joints, rad or m; NaN for dofs of ball and free joints."""
        return creature.positions(self.world.setup.solid, self.world.solid.q, dofs)

    def joints_away(self, dofs: Integers, positions: Array) -> Array:
        """(k,) displacement to the present pose of the joints of `dofs` from given entries of q."""
        model, q = self.world.setup.solid, self.world.solid.q
        start = q.copy()
        start[model.indices_of(dofs)] = positions
        return model.difference(start, q)[dofs]

    def body_rotation(self, body: int) -> Array:
        """(3, 3) columns are the body's axes in the world."""
        return self._pose.body_rotation[body]

    def body_position(self, body: int) -> Array:
        """(3,) origin of the body's frame, m."""
        return self._pose.body_position[body]

    def body_velocity(self, body: int) -> Array:
        """(3,) velocity of the origin of the body's frame, m/s."""
        twist = self._pose.twist_jacobian[body] @ self.world.solid.v
        return twist[:3] + np.cross(twist[3:], self.body_position(body))

    def whole_velocity(self) -> Array:
        """(3,) velocity of the centre of mass of all bodies and their flesh, m/s."""
        model = self.world.setup.solid
        return momentum(model, self.world.solid)[0] / model.body_mass.sum()
