"""A decision that looks ahead: poses at the times of several decisions, tried by going there.

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
from numpy.typing import NDArray

from flowborne.control import creature
from flowborne.control.course import Step, TrialError, advance
from flowborne.control.measurement import Measurement
from flowborne.control.objectives import ObjectiveSum
from flowborne.coupling.servo import Servo

if TYPE_CHECKING:
    from flowborne.coupling.world import World

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


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

    world      as it is now; only its copy is stepped
    step       the physics
    objective  what is measured, at the time of each step
    horizon    in what steps
    dofs       (n,) the controlled dofs
    servo      how their drives approach a pose
    poses      (knots, nq) those of the plan
    """

    world: World
    step: Step
    objective: ObjectiveSum
    horizon: Horizon
    dofs: Integers
    servo: Servo
    poses: Array

    def run(self) -> float:
        """Mean of the objective over the steps. Raises TrialError when it is not finite."""
        world, dt, total = self.world.copy(), self.horizon.dt, 0.0
        world.setup = world.setup.rehearsed
        for pose in self.poses:
            for left in range(self.horizon.steps, 0, -1):
                command = creature.approach(world, self.dofs, self.servo, pose, left * dt, dt)
                report = advance(self, world, dt, command)
                total += self.objective.value(Measurement(world, report))
        if not np.isfinite(total):
            raise TrialError.of(self, dt, f"the objective is {total}")
        return total / (len(self.poses) * self.horizon.steps)

    @property
    def tried(self) -> str:
        """What is tried and when, in words."""
        return f"follows a plan made at time {self.world.time:.6g} s"


@dataclass(frozen=True, eq=False)
class PlanCourse:
    """Going along a plan, pose by pose.

    world, step, horizon, dofs, servo  as in `RolloutEvaluation`
    most   (knots n,) the farthest that strength allows from knot to knot, rad or m
    moves  (knots n,) displacement of the dofs from knot to knot, those to the first knot first
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
        allowed = [move[self.dofs] for move, _ in self._way(wanted)]
        return np.concatenate(allowed) - self.moves

    def trial(self, objective: ObjectiveSum, displacement: Array) -> RolloutEvaluation:
        return RolloutEvaluation(
            self.world,
            self.step,
            objective,
            self.horizon,
            self.dofs,
            self.servo,
            np.array([pose for _, pose in self._way(self.moves + displacement)]),
        )

    def displaced(self, displacement: Array) -> PlanCourse:
        return replace(self, moves=self.moves + displacement)

    @property
    def goal(self) -> Array:
        """(nq,) pose at the first knot."""
        return next(self._way(self.moves))[1]

    def _way(self, moves: Array) -> Iterator[tuple[Array, Array]]:
        """(nv,) the part of each of the moves (knots n,) that ranges allow, and the pose (nq,) to
        which it leads."""
        model, state = creature.parts(self.world)
        pose, move = state.q, np.zeros(model.nv)
        for wanted in moves.reshape(self.horizon.knots, -1):
            move[self.dofs] = wanted
            allowed = creature.within_range(model, pose, move)
            pose = creature.moved(model, pose, allowed)
            yield allowed, pose
