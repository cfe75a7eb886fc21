"""The input of an objective: a world after a step, and the report of the step."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from flowborne.control import creature
from flowborne.coupling.named import BodyState, JointState, Named
from flowborne.coupling.report import StepReport

if TYPE_CHECKING:
    from flowborne.coupling.world import World

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


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
    def _named(self) -> Named:
        return Named.after(self.world, self.report)

    def body(self, name: str) -> BodyState:
        """Everything that is known of a body. Raises ValueError for an unknown name."""
        return self._named.body(name)

    def joint(self, name: str) -> JointState:
        """Everything that is known of a joint. Raises ValueError for an unknown name."""
        return self._named.joint(name)

    def joint_positions(self, dofs: Integers) -> Array:
        """(k,) positions of scalar joints, rad or m; NaN for dofs of ball and free joints."""
        return creature.positions(self.world, dofs)

    def joints_away(self, dofs: Integers, places: Array) -> Array:
        """(k,) displacement to the present pose of the joints of `dofs` from given entries of q."""
        return creature.away(self.world, dofs, places)

    def body_rotation(self, body: int) -> Array:
        """(3, 3) columns are the body's axes in the world."""
        return creature.body_rotation(self.world, body)

    def body_position(self, body: int) -> Array:
        """(3,) origin of the body's frame, m."""
        return creature.body_position(self.world, body)

    def body_velocity(self, body: int) -> Array:
        """(3,) velocity of the origin of the body's frame, m/s."""
        return creature.body_velocity(self.world, body)

    def whole_velocity(self) -> Array:
        """(3,) velocity of the centre of mass of all bodies, m/s."""
        return creature.whole_velocity(self.world)
