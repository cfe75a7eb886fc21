"""The variables of a decision, and its trials: the objective as a function of a displacement.

A decision changes a course: the pose to which the joints move (`trial`), or the poses of a plan
that looks ahead (`plan`). Gradients and rules only get its variables, in rad or m.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Self

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


@dataclass(frozen=True, eq=False)
class Course(ABC):
    """The motion of the controlled joints that a decision changes.

    world  the present state; trials step copies of it
    step   the physics
    """

    world: World
    step: Step

    @property
    @abstractmethod
    def count(self) -> int:
        """N, number of decision variables."""

    @property
    @abstractmethod
    def goal(self) -> Array:
        """(nq,) pose at the time of the next decision."""

    @abstractmethod
    def within_range(self, displacement: Array) -> Array:
        """(N,) the part of a displacement, rad or m, that the joints allow."""

    @abstractmethod
    def displaced(self, displacement: Array) -> Self:
        """The course displaced by (N,)."""

    @abstractmethod
    def evaluate(self, objective: ObjectiveSum, displacement: Array) -> float:
        """The objective on the course displaced by (N,), complete in itself: it may run in any
        thread or process. Raises TrialError when it is not finite."""

    @abstractmethod
    def tried(self, displacement: Array) -> str:
        """What that does to the joints and when, as "moves knee by 0.1 at time 2 s"."""

    def advance(
        self, world: World, dt: float, command: JointCommand, displacement: Array
    ) -> StepReport:
        """Take `world` through a hypothetical step of an evaluation. Raises TrialError when its
        numbers are not finite."""
        report = self.step(world, dt, command)
        if report.outcome in (Outcome.NOT_FINITE, Outcome.ADVECTION_NOT_FINITE):
            raise self.error(displacement, dt, report.outcome.value)
        return report

    def error(self, displacement: Array, dt: float, what: str) -> TrialError:
        """The error of a step of dt (s) in an evaluation; `what` is wrong."""
        return TrialError(
            f"in a hypothetical step of {dt:.4g} s that {self.tried(displacement)}, {what}; "
            "try a smaller displacement or a shorter step"
        )


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
        evaluate = partial(self.course.evaluate, self.objective)
        self.evaluations += len(displacements)
        return np.array(self.mapper.map(evaluate, [self._full(row) for row in displacements]))

    def _full(self, displacement: Array) -> Array:
        """(N,) a displacement (m,) of all decision variables."""
        full = np.zeros(self.course.count)
        full[self.indices] = displacement
        return full
