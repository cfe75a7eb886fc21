"""The controller chooses targets for the controlled joints, and drives the joints towards them.

Paper: sections 2.1 and 4.3 (algorithm).

Method: docs/method/control.md.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from flowborne.base.errors import PartError
from flowborne.base.one_line import one_line
from flowborne.control import creature
from flowborne.control.course import Course, Step, Trials
from flowborne.control.executors import Mapper, Threads
from flowborne.control.gradients import Gradient, GradientCentral
from flowborne.control.measurement import Measurement
from flowborne.control.objectives import ObjectiveSum
from flowborne.control.phases import Phases
from flowborne.control.plan import Horizon, PlanCourse
from flowborne.control.rules import FixedStep, Rule
from flowborne.control.trial import Hypothesis, PoseCourse, without_scalars
from flowborne.coupling.report import BREAKDOWNS, StepReport
from flowborne.kernels.arrays import Array, Integers, Mask
from flowborne.solids.trajectories import JointCommand, Servo, ServoExact

if TYPE_CHECKING:
    from flowborne.coupling.world import World


@dataclass(frozen=True, eq=False)
class Decision:
    """What the controller decided at the start of a frame.

    decided       False in frames between decisions, which repeat the numbers of the last one
    objective     weighted sum before the decision, from its trials: the mean of all trials for
                  central differences, the trial without a displacement for one-sided ones; with a
                  horizon the mean over the plan; the sum over groups of joints with different
                  objectives. 0 when no term is active
    gradient      (n,) in the present pose, per rad or m
    displacement  (n,) from the pose at the decision to the target, rad or m
    target        (nq,) pose whose controlled entries are the target
    evaluations   number of trials run
    seconds       wall-clock time of the decision
    """

    decided: bool
    objective: float
    gradient: Array
    displacement: Array
    target: Array
    evaluations: int
    seconds: float


@dataclass(frozen=True)
class StrengthInPhase:
    """Strength of some dofs in phases, where it replaces their usual strength.

    indices   (m,) numbers of the dofs among the controlled ones, from 0
    strength  rad/s or m/s; one for all of them or one each
    phases    when it applies
    """

    indices: tuple[int, ...]
    strength: float | tuple[float, ...]
    phases: Phases


@dataclass(frozen=True, eq=False)
class Controller:
    """Gradient descent on an objective over the controlled joints, within the creature's strength.

    Its state is in the world's memory: "target" (nq,), "displacement" (n,), "gradient" (n,),
    "objective" (1,), "step_scale" (2, n): the rule's scale and the gradient that it came from,
    "schedule" (2,): frames left after this one until the next decision, and the frame time in s.
    A horizon adds "plan" (knots, n), displacements from knot to knot; "step_scale" is then
    (2, knots n).

    dofs        (n,) controlled dofs, indices into v
    objective   what to minimise
    hypothesis  how a pose is tried, or how far a plan looks ahead
    strength    rad/s or m/s, maximum speed of a dof; one for all dofs or one each
    gradient    finite difference
    rule        how far to go down the gradient
    every       number of frames from decision to decision. The step may use the strength of all
                these frames, and is spread evenly over them
    iterations  descent steps per decision, each from the pose found so far, in the present flow.
                More than one is the paper's infinite strength: the target may be as many steps away
    servo       how the drives approach the target
    executor    where the trials run
    in_phases   strength in phases; of several active ones the last counts
    raises      ValueError for no, negative or repeated dofs, a strength that is not positive and
                finite or not one per dof, every < 1 or iterations < 1
    """

    __repr__ = one_line

    dofs: Integers
    objective: ObjectiveSum
    hypothesis: Hypothesis | Horizon
    strength: float | tuple[float, ...]
    gradient: Gradient = field(default_factory=partial(GradientCentral, math.radians(10.0)))
    rule: Rule = field(default_factory=FixedStep)
    every: int = 1
    iterations: int = 1
    servo: Servo = field(default_factory=ServoExact)
    executor: Mapper = field(default_factory=Threads)
    in_phases: tuple[StrengthInPhase, ...] = ()

    def __post_init__(self) -> None:
        dofs = np.asarray(self.dofs)
        if dofs.ndim != 1 or dofs.size == 0 or dofs.min() < 0 or np.unique(dofs).size < dofs.size:
            raise ValueError(f"controlled dofs are {dofs.tolist()}: give at least one, each once")
        object.__setattr__(self, "dofs", dofs.astype(np.int64))
        given = {"strength": self.strength, "servo.torque_limit": self.servo.torque_limit}
        for name, value in given.items():
            values = np.asarray(value, dtype=np.float64)
            if values.ndim and values.shape != dofs.shape:
                raise ValueError(
                    f"{name} has {values.size} values for {dofs.size} controlled dofs: "
                    "give one for all or one each"
                )
        for strength in (self.strength, *(other.strength for other in self.in_phases)):
            values = np.asarray(strength, dtype=np.float64)
            if not (np.all(values > 0.0) and np.all(np.isfinite(values))):
                raise ValueError(
                    f"strength is {strength}: give positive finite numbers in rad/s or m/s"
                )
        if self.every < 1 or self.iterations < 1:
            raise ValueError(
                f"every is {self.every} frames and iterations {self.iterations}: "
                "both must be at least 1"
            )

    def decide(self, world: World, frame_time: float, step: Step) -> Decision:
        """Choose the target for the coming frames; call at the start of every frame.

        Only the memory of the world changes.

        frame_time  s
        raises      TrialError when a hypothetical step blows up
        """
        started = perf_counter()
        memory = world.memory
        if "schedule" in memory and memory["schedule"][0] >= 1.0:
            memory["schedule"] = np.array([memory["schedule"][0] - 1.0, frame_time])
            return self._decision(world, False, 0, started)
        course, value, gradient, evaluations = self._descend(world, frame_time, step)
        memory["target"] = goal = course.goal
        difference = world.setup.solid.difference(world.solid.q, goal)
        memory["displacement"] = difference[self.dofs]
        memory["gradient"] = gradient[: self.dofs.size]
        memory["objective"] = np.array([value])
        if isinstance(course, PlanCourse):
            memory["plan"] = course.moves.reshape(-1, self.dofs.size)
        memory["schedule"] = np.array([self.every - 1.0, frame_time])
        return self._decision(world, True, evaluations, started)

    def memory_shapes(self, nq: int) -> dict[str, tuple[int, ...]]:
        """Shapes of its arrays in a world's memory, by name; a pose has nq numbers."""
        n = self.dofs.size
        knots = self.hypothesis.knots if isinstance(self.hypothesis, Horizon) else 1
        return {
            "target": (nq,),
            "displacement": (n,),
            "gradient": (n,),
            "objective": (1,),
            "step_scale": (2, knots * n),
            "schedule": (2,),
            "plan": (knots, n),
        }

    def strength_at(self, time: float) -> Array:
        """(n,) maximum speed of each controlled dof at `time` (s), rad/s or m/s."""
        strength = self._strengths()
        for other in self.in_phases:
            if other.phases.active(time):
                strength[list(other.indices)] = other.strength
        return strength

    def greatest_strength(self) -> Array:
        """(n,) maximum of `strength_at` over all times."""
        greatest = self._strengths()
        for other in self.in_phases:
            indices = list(other.indices)
            greatest[indices] = np.maximum(greatest[indices], other.strength)
        return greatest

    def _strengths(self) -> Array:
        """(n,) a copy of `strength`, one for each dof."""
        return np.array(np.broadcast_to(self.strength, self.dofs.shape), dtype=np.float64)

    def command(self, world: World, frame_end_time: float, dt: float) -> JointCommand:
        """Command to the controlled dofs for the next step: zero velocity before any decision.

        frame_end_time  s, end of the frame that the step is in
        dt              s, length of the step
        """
        if "target" not in world.memory:
            command = JointCommand.none(world.solid.v.size)
            command.set(self.dofs, 0.0, 0.0, np.asarray(self.servo.torque_limit, dtype=np.float64))
            return command
        left, frame_time = world.memory["schedule"]
        remaining = float(frame_end_time + left * frame_time - world.time)
        target = world.memory["target"]
        return creature.approach(world, self.dofs, self.servo, target, remaining, dt)

    def measure(self, world: World, report: StepReport) -> dict[str, float]:
        """Value of each term after a real step."""
        return self.objective.values(Measurement(world, report))

    def trials(
        self,
        world: World,
        step: Step,
        course: Course | None = None,
        objective: ObjectiveSum | None = None,
        indices: Integers | None = None,
        scale: Array | None = None,
    ) -> Trials:
        """An objective as a function of the displacement of a course in `world`.

        course     the present pose when None
        objective  the controller's own when None
        indices    (m,) decision variables that are displaced; all when None
        scale      (N,) part of the gradient's displacements, 1 when None
        """
        course = self._here(world, step) if course is None else course
        indices = np.arange(course.count) if indices is None else indices
        scale = np.ones(course.count) if scale is None else scale
        return Trials(
            course,
            self.objective if objective is None else objective,
            self.gradient.of(indices % self.dofs.size, scale[indices]),
            self.executor,
            indices,
        )

    def course(self, world: World, frame_time: float, step: Step) -> Course:
        """Start of a decision: the present pose, or the rest of the last plan.

        frame_time  s
        """
        if isinstance(self.hypothesis, Hypothesis):
            return self._here(world, step)
        most = self._limit(world.time, frame_time)
        moves = world.memory.get("plan", np.zeros((1, self.dofs.size)))[1:].ravel()
        moves = np.append(moves, np.zeros(most.size - moves.size))
        how = self.hypothesis
        course = PlanCourse(without_scalars(world), step, how, self.dofs, self.servo, most, moves)
        return course.displaced(course.within_range(np.zeros(course.count)))

    def _here(self, world: World, step: Step) -> PoseCourse:
        """The present pose; with a horizon, its trials make their displacement in one step."""
        how = self.hypothesis
        how = Hypothesis(how.dt, velocities="probe") if isinstance(how, Horizon) else how
        return PoseCourse(without_scalars(world), step, how, self.dofs, world.solid.q.copy())

    def _limit(self, time: float, frame_time: float) -> Array:
        """(N,) limit by strength on each variable of a decision at `time` (s), rad or m."""
        knots = self.hypothesis.knots if isinstance(self.hypothesis, Horizon) else 1
        interval = self.every * frame_time
        strength = [self.strength_at(time + knot * interval) for knot in range(knots)]
        return interval * np.concatenate(strength)

    def positions(self, world: World) -> Array:
        """(n,) present positions of controlled scalar joints, rad or m; NaN for ball dofs."""
        return creature.positions(world.setup.solid, world.solid.q, self.dofs)

    def targets(self, world: World) -> Array:
        """(n,) targets of controlled scalar joints; present positions before the first decision."""
        target = world.memory.get("target", world.solid.q)
        return creature.positions(world.setup.solid, target, self.dofs)

    def close(self) -> None:
        """Stop the workers."""
        self.executor.close()

    def _descend(
        self, world: World, frame_time: float, step: Step
    ) -> tuple[Course, float, Array, int]:
        """The new course; objective and gradient (N,) on the course before; number of trials.

        Groups of dofs with different objectives descend separately, from the same course.
        """
        course = self.course(world, frame_time, step)
        size, value, evaluations = course.count, 0.0, 0
        gradient = np.zeros(size)
        scale, slope = world.memory.get("step_scale", np.array([np.ones(size), gradient])).copy()
        limit, rule = self._limit(world.time, frame_time), self.rule
        groups = self._groups(world, size)
        for iteration in range(self.iterations):
            displacement = np.zeros(size)
            for indices, objective in groups:
                trials = self.trials(world, step, course, objective, indices, scale)
                estimate, slopes = self._estimate(trials)
                if iteration == 0:
                    value, gradient[indices] = value + estimate, slopes
                ask = partial(rule.step_scale, scale[indices], slope[indices], slopes)
                expected = "a scale above 0 and at most 1"
                scale[indices] = _asked("rule", rule, ask, expected, slopes.shape, _is_scale)
                slope[indices] = slopes
                ask = partial(rule.step, trials, slopes, limit[indices])
                wanted = _asked(
                    "rule", rule, ask, "a finite displacement in rad or m", slopes.shape
                )
                displacement[indices] = trials.within_range(scale[indices] * wanted)
                evaluations += trials.evaluations
            if not displacement.any():
                break
            course = course.displaced(displacement)
        world.memory["step_scale"] = np.array([scale, slope])
        return course, value, gradient, evaluations

    def _groups(self, world: World, size: int) -> list[tuple[Integers, ObjectiveSum]]:
        """Indices into the variables (N,) of a decision, in groups with the same objectives, and
        their sum. Dofs that are told are left out, and groups without an active term, except on a
        plan, where terms can become active later."""
        knots = self.dofs.size * np.arange(size // self.dofs.size)[:, None]
        told, groups = np.isin(self.dofs, world.told.dofs()), []
        for indices, objective in self.objective.group_by_joints(self.dofs):
            left = indices[~told[indices]]
            if left.size and (isinstance(self.hypothesis, Horizon) or objective.active(world.time)):
                groups.append(((knots + left).ravel(), objective))
        return groups

    def _estimate(self, trials: Trials) -> tuple[float, Array]:
        """Objective and its gradient (m,). Raises PartError if the estimate is no such pair."""
        with PartError.guarding(
            f"gradient {type(self.gradient).__name__}", *BREAKDOWNS, MemoryError
        ):
            estimate = trials.estimator.estimate(trials)
        asked = partial(_asked, "gradient", self.gradient)
        expected = "an Estimate of numbers, whose gradient has one"
        (number,) = asked(lambda: [getattr(estimate, "value", estimate)], expected, (1,))
        slopes = asked(lambda: getattr(estimate, "gradient", estimate), expected, (trials.count,))
        return float(number), slopes

    def _decision(self, world: World, decided: bool, evaluations: int, started: float) -> Decision:
        memory = world.memory
        return Decision(
            decided,
            float(memory["objective"][0]),
            memory["gradient"].copy(),
            memory["displacement"].copy(),
            memory["target"].copy(),
            evaluations,
            perf_counter() - started,
        )


def _asked(
    kind: str,
    part: object,
    ask: Callable[[], object],
    expected: str,
    shape: tuple[int, ...],
    valid: Callable[[Array], Mask] = np.isfinite,
) -> Array:
    """The numbers that a rule or gradient returns. Raises PartError if they are not `expected`, or
    if the part fails; errors of trials pass."""
    name = f"{kind} {type(part).__name__}"
    with PartError.guarding(name, *BREAKDOWNS, MemoryError):
        given = ask()
    with suppress(ArithmeticError, TypeError, ValueError):
        found = np.asarray(given, dtype=np.float64)
        if found.shape == shape and valid(found).all():
            return found
    raise PartError(f"{name} gave {given!r:.100}: return {expected} for each of {shape[0]} dofs")


def _is_scale(values: Array) -> Mask:
    return (values > 0.0) & (values <= 1.0)
