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
from typing import TYPE_CHECKING

import numpy as np

from flowborne.control import creature
from flowborne.control.course import Step, TrialError, advance
from flowborne.control.measurement import Measurement
from flowborne.control.objectives import ObjectiveSum
from flowborne.kernels.arrays import Array, Integers
from flowborne.solids.trajectories import Servo

if TYPE_CHECKING:
    from flowborne.coupling.world import World


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
class RolloutEvaluation:
    """One evaluation of a plan, complete in itself: it may run in any thread or process.

    course     gives the world, whose copy is stepped, and the drives
    objective  what is measured, after each step
    poses      (knots, nq) of the plan
    """

    course: PlanCourse
    objective: ObjectiveSum
    poses: Array

    def run(self) -> float:
        """Mean of the objective over the steps. Raises TrialError when it is not finite."""
        course, horizon = self.course, self.course.horizon
        world, dt, total = course.world.copy(), horizon.dt, 0.0
        world.setup = world.setup.rehearsed
        for pose in self.poses:
            for left in range(horizon.steps, 0, -1):
                command = creature.approach(world, course.dofs, course.servo, pose, left * dt, dt)
                report = advance(self, world, dt, command)
                total += self.objective.value(Measurement(world, report))
        if not np.isfinite(total):
            raise TrialError.of(self, dt, f"the objective is {total}")
        return total / (len(self.poses) * horizon.steps)

    @property
    def tried(self) -> str:
        return f"follows a plan made at time {self.course.world.time:.6g} s"


@dataclass(frozen=True, eq=False)
class PlanCourse:
    """A plan: the controlled joints move from pose to pose.

    world    the present state
    step     the physics
    horizon  length of the plan and of its steps
    dofs     (n,) the controlled dofs
    servo    how their drives approach a pose
    most     (knots n,) limit by strength on the moves, rad or m
    moves    (knots n,) displacement of the dofs from knot to knot, first knot first
    """

    world: World
    step: Step
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
        allowed = [move[self.dofs] for move, _ in self._poses(wanted)]
        return np.concatenate(allowed) - self.moves

    def trial(self, objective: ObjectiveSum, displacement: Array) -> RolloutEvaluation:
        poses = np.array([pose for _, pose in self._poses(self.moves + displacement)])
        return RolloutEvaluation(self, objective, poses)

    def displaced(self, displacement: Array) -> PlanCourse:
        return replace(self, moves=self.moves + displacement)

    @property
    def goal(self) -> Array:
        """(nq,) pose at the first knot."""
        return next(self._poses(self.moves))[1]

    def _poses(self, moves: Array) -> Iterator[tuple[Array, Array]]:
        """(nv,) the part of each move of (knots n,) that ranges allow, and the pose (nq,) after."""
        model = self.world.setup.solid
        pose, move = self.world.solid.q, np.zeros(model.nv)
        for wanted in moves.reshape(self.horizon.knots, -1):
            move[self.dofs] = wanted
            allowed = creature.within_range(model, pose, move)
            pose = creature.moved(model, pose, allowed)
            yield allowed, pose
