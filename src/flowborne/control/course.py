"""The variables of a decision, and its trials: the objective as a function of a displacement.

A decision changes a course: the pose to which the joints move (`trial`), or the poses of a plan
that looks ahead (`plan`). Gradients and rules only get its variables, in rad or m.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from operator import methodcaller
from typing import TYPE_CHECKING, Protocol, Self

import numpy as np

from flowborne.control.executors import Mapper
from flowborne.control.gradients import Gradient, OffsetPoses
from flowborne.control.objectives import ObjectiveSum
from flowborne.coupling.report import Outcome, StepReport
from flowborne.kernels.arrays import Array, Integers
from flowborne.solids.trajectories import JointCommand

if TYPE_CHECKING:
    from flowborne.coupling.world import World

Step = Callable[["World", float, JointCommand | None], StepReport]
"""step(world, dt, command): advances `world` in place."""


class TrialError(ArithmeticError):
    """A hypothetical step, or the objective after it, is not a finite number."""

    @classmethod
    def of(cls, evaluation: Evaluation, dt: float, what: str) -> TrialError:
        """The error of a step of dt (s) in an evaluation; `what` is wrong."""
        return cls(
            f"in a hypothetical step of {dt:.4g} s that {evaluation.tried}, {what}; "
            "try a smaller displacement or a shorter step"
        )


def advance(evaluation: Evaluation, world: World, dt: float, command: JointCommand) -> StepReport:
    """Take `world` through a hypothetical step of an evaluation. Raises TrialError when its numbers
    are not finite."""
    report = evaluation.course.step(world, dt, command)
    if report.outcome in (Outcome.NOT_FINITE, Outcome.ADVECTION_NOT_FINITE):
        raise TrialError.of(evaluation, dt, report.outcome.value)
    return report


class Evaluation(Protocol):
    """One evaluation of an objective, complete in itself: it may run in any thread or process.

    tried  what it does to the joints and when, as "moves knee by 0.1 at time 2 s"
    """

    @property
    def course(self) -> Course: ...

    @property
    def tried(self) -> str: ...

    def run(self) -> float:
        """The objective. Raises TrialError when it is not finite."""
        ...


class Course(Protocol):
    """The motion of the controlled joints that a decision changes.

    world  the present state; trials step copies of it
    step   the physics
    count  N, number of decision variables
    goal   (nq,) pose at the time of the next decision
    """

    @property
    def world(self) -> World: ...

    @property
    def step(self) -> Step: ...

    @property
    def count(self) -> int: ...

    @property
    def goal(self) -> Array: ...

    def within_range(self, displacement: Array) -> Array:
        """(N,) the part of a displacement, rad or m, that the joints allow."""
        ...

    def trial(self, objective: ObjectiveSum, displacement: Array) -> Evaluation:
        """Evaluation of the objective on the course displaced by (N,)."""
        ...

    def displaced(self, displacement: Array) -> Self:
        """The course displaced by (N,)."""
        ...


@dataclass(eq=False)
class Trials:
    """The objective as a function of the displacement of a course.

    estimator    of the gradient
    mapper       runs the trials
    indices      (m,) decision variables that are displaced; the others stay
    evaluations  number of trials run so far
    """

    course: Course
    objective: ObjectiveSum
    estimator: Gradient
    mapper: Mapper
    indices: Integers
    evaluations: int = 0

    @property
    def count(self) -> int:
        """m."""
        return int(self.indices.size)

    def within_range(self, displacement: Array) -> Array:
        """(m,) the part of a displacement (m,) that the joints allow."""
        return self.course.within_range(self._full(displacement))[self.indices]

    def gradient(self, displacement: Array) -> Array:
        """(m,) gradient on a displaced course by the displacement (m,). Raises TrialError."""
        return self.estimator.estimate(OffsetPoses(self, displacement)).gradient

    def values(self, displacements: Array) -> Array:
        """(k,) objective on courses displaced by the rows of (k, m). Raises TrialError."""
        trials = [self.course.trial(self.objective, self._full(row)) for row in displacements]
        self.evaluations += len(trials)
        return np.array(self.mapper.map(methodcaller("run"), trials))

    def _full(self, displacement: Array) -> Array:
        """(N,) a displacement (m,) of all decision variables."""
        full = np.zeros(self.course.count)
        full[self.indices] = displacement
        return full
