"""A decision that looks ahead: poses at the times of several decisions.

A plan has a knot at the time of each decision within its horizon: a pose that the drives approach
from the previous one. A trial simulates the plan on a copy of the world, step by step, and its
objective is the mean over the steps. Only the motion to the first knot is executed before the next
decision, which starts from the rest of the plan (receding horizon). The paper names the lack of
this as a limit (section 8).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from flowborne.control import creature
from flowborne.control.course import Course
from flowborne.control.measurement import Measurement
from flowborne.control.objectives import ObjectiveSum
from flowborne.kernels.arrays import Array, Integers
from flowborne.solids.trajectories import Servo


@dataclass(frozen=True)
class Horizon:
    """How far a decision looks ahead, and in what steps.

    dt      s, length of a hypothetical step
    steps   number of them from knot to knot, which is from decision to decision
    knots   number of decisions that a plan reaches over
    raises  ValueError when dt is not positive, or steps or knots < 1
    """

    dt: float
    steps: int
    knots: int

    def __post_init__(self) -> None:
        if not 0.0 < self.dt < np.inf:
            raise ValueError(f"hypothetical step is {self.dt} s: give a positive number of seconds")
        if self.steps < 1 or self.knots < 1:
            raise ValueError(
                f"a horizon has {self.knots} knots of {self.steps} steps: give at least 1 of both"
            )


@dataclass(frozen=True, eq=False)
class PlanCourse(Course):
    """A plan: the controlled joints move from pose to pose.

    horizon  length of the plan and of its steps
    dofs     (n,) the controlled dofs
    servo    how their drives approach a pose
    most     (knots n,) limit by strength on the moves, rad or m
    moves    (knots n,) displacement of the dofs from knot to knot, first knot first
    """

    horizon: Horizon
    dofs: Integers
    servo: Servo
    most: Array
    moves: Array

    @property
    def count(self) -> int:
        """knots n."""
        return int(self.moves.size)

    def within_range(self, displacement: Array) -> Array:
        """(knots n,) the part of a displacement of the moves that strength and the joints' ranges
        allow."""
        wanted = np.clip(self.moves + displacement, -self.most, self.most)
        allowed = [move[self.dofs] for move, _ in self.poses(wanted)]
        return np.concatenate(allowed) - self.moves

    def evaluate(self, objective: ObjectiveSum, displacement: Array) -> float:
        """Mean of the objective over the steps. Raises TrialError when it is not finite."""
        horizon, world, total = self.horizon, self.world.for_step(), 0.0
        world.setup, dt = world.setup.rehearsed, horizon.dt
        for _, pose in self.poses(self.moves + displacement):
            for left in range(horizon.steps, 0, -1):
                command = creature.approach(world, self.dofs, self.servo, pose, left * dt, dt)
                report = self.advance(world, dt, command, displacement)
                total += objective.value(Measurement(world, report))
        if not np.isfinite(total):
            raise self.error(displacement, dt, f"the objective is {total}")
        return total / (horizon.knots * horizon.steps)

    def tried(self, displacement: Array) -> str:
        return f"follows a plan made at time {self.world.time:.6g} s"

    def displaced(self, displacement: Array) -> PlanCourse:
        return replace(self, moves=self.moves + displacement)

    @property
    def goal(self) -> Array:
        """(nq,) pose at the first knot."""
        return next(self.poses(self.moves))[1]

    def poses(self, moves: Array) -> Iterator[tuple[Array, Array]]:
        """(nv,) the part of each move of (knots n,) that ranges allow, and the pose (nq,) after."""
        model = self.world.setup.solid
        pose, move = self.world.solid.q, np.zeros(model.nv)
        for wanted in moves.reshape(self.horizon.knots, -1):
            move[self.dofs] = wanted
            allowed = creature.within_range(model, pose, move)
            pose = creature.moved(model, pose, allowed)
            yield allowed, pose
