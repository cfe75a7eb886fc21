"""The controller: decides targets for the controlled joints and drives the joints there.

Paper: sections 2.1 and 4.3 (algorithm).
"""

from __future__ import annotations

import math
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from functools import partial
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

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
from flowborne.coupling.motion import JointCommand
from flowborne.coupling.report import BREAKDOWNS, StepReport
from flowborne.coupling.servo import Servo, ServoExact
from flowborne.errors import PartError

if TYPE_CHECKING:
    from flowborne.coupling.world import World

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Decision:
    """What the controller decided at the start of a frame.

    decided       False in frames between decisions; the numbers are then those of the last one
    objective     weighted sum in the pose from which the decision set out, as its trials evaluate
                  it: the mean of all of them for central differences, the trial without a
                  displacement for one-sided ones; with a horizon the mean over the plan; where
                  joints have different objectives, the sum of theirs. 0 when no term is on
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
    """Strength of some dofs while its phases are on; it replaces their usual strength.

    indices    (m,) which of the controlled dofs, counted from 0
    strength  rad/s or m/s; one for all of them or one each
    phases    when
    """

    indices: tuple[int, ...]
    strength: float | tuple[float, ...]
    phases: Phases


@dataclass(frozen=True, eq=False)
class Controller:
    """Gradient descent on an objective over the controlled joints, within the creature's strength.

    Its own state is in the world's memory: "target" (nq,), "displacement" (n,), "gradient" (n,),
    "objective" (1,), "step_scale" (2, n): that of the rule and the gradient that it came from,
    "schedule" (2,): frames left after this one until the next decision, and the frame time in s,
    and with a horizon "plan" (knots, n): displacements from knot to knot; "step_scale" is then
    (2, knots n).

    dofs        (n,) controlled dofs, indices into v
    objective   what to minimise
    hypothesis  how a pose is tried, or how far a plan looks ahead
    strength    rad/s or m/s, the fastest that a dof moves; one for all dofs or one each
    gradient    finite difference
    rule        how far to go down the gradient
    every       a decision every so many frames; its step is as long as strength allows in all of
                them together and is spread evenly over them
    iterations  descent steps per decision, each from the pose found so far in the flow as it is
                now; more than one is the paper's infinite strength, and the target may be as many
                steps away
    servo       how the drives approach the target
    executor    where the trials run
    in_phases   strength at times; where several are on, the last one counts
    raises      ValueError for controlled dofs that are none, negative or repeated, a strength that
                is not positive and finite or not one per dof, every < 1 or iterations < 1
    """

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
        for name in ("strength", "servo.torque_limit"):
            values = np.asarray(
                self.strength if name == "strength" else self.servo.torque_limit, dtype=np.float64
            )
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

        Nothing of the world changes but its memory.

        frame_time  s
        raises      TrialError when a hypothetical step blows up
        """
        started = perf_counter()
        memory = world.memory
        if "schedule" in memory and memory["schedule"][0] >= 1.0:
            memory["schedule"] = np.array([memory["schedule"][0] - 1.0, frame_time])
            return self._decision(world, False, 0, started)
        course, value, gradient, evaluations = self._descend(world, frame_time, step)
        model, state = creature.parts(world)
        memory["target"] = goal = course.goal
        memory["displacement"] = model.difference(state.q, goal)[self.dofs]
        memory["gradient"] = gradient[: self.dofs.size]
        memory["objective"] = np.array([value])
        if isinstance(course, PlanCourse):
            memory["plan"] = course.moves.reshape(-1, self.dofs.size)
        memory["schedule"] = np.array([self.every - 1.0, frame_time])
        return self._decision(world, True, evaluations, started)

    def memory_shapes(self, nq: int) -> dict[str, tuple[int, ...]]:
        """Shapes of its arrays in a world's memory, by name; nq numbers are a pose."""
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
        """(n,) the fastest that each controlled dof moves at `time` (s), rad/s or m/s."""
        strength = self._strengths()
        for other in self.in_phases:
            if other.phases.active(time):
                strength[list(other.indices)] = other.strength
        return strength

    def greatest_strength(self) -> Array:
        """(n,) as `strength_at`, the most of all times."""
        greatest = self._strengths()
        for other in self.in_phases:
            indices = list(other.indices)
            greatest[indices] = np.maximum(greatest[indices], other.strength)
        return greatest

    def _strengths(self) -> Array:
        """(n,) a copy of `strength`, one for each dof."""
        return np.array(np.broadcast_to(self.strength, self.dofs.shape), dtype=np.float64)

    def command(self, world: World, frame_end_time: float, dt: float) -> JointCommand:
        """Command to the controlled dofs for the next step; without a decision yet, to hold still.

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
        """Every term's own value after a real step."""
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
        """An objective as a function of what a course in `world` is displaced by.

        course     the present pose when None
        objective  the controller's own when None
        indices     (m,) those of the course's numbers that are displaced; all when None
        scale       (N,) part of the gradient's displacements, 1 when None
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
        """The present pose, with a horizon too: its trials move as far in one of its steps."""
        _, state = creature.parts(world)
        how = self.hypothesis
        how = Hypothesis(how.dt, velocities="probe") if isinstance(how, Horizon) else how
        return PoseCourse(without_scalars(world), step, how, self.dofs, state.q.copy())

    def _limit(self, time: float, frame_time: float) -> Array:
        """(N,) what strength allows of each number of a course that is decided at `time` (s)."""
        knots = self.hypothesis.knots if isinstance(self.hypothesis, Horizon) else 1
        interval = self.every * frame_time
        strength = [self.strength_at(time + knot * interval) for knot in range(knots)]
        return interval * np.concatenate(strength)

    def positions(self, world: World) -> Array:
        """(n,) present positions of controlled scalar joints, rad or m; NaN for ball dofs."""
        return creature.positions(world, self.dofs)

    def targets(self, world: World) -> Array:
        """(n,) targets of controlled scalar joints; before the first decision where they are."""
        model, state = creature.parts(world)
        return creature.positions_in(model, world.memory.get("target", state.q), self.dofs)

    def close(self) -> None:
        """Stop the workers."""
        self.executor.close()

    def _descend(
        self, world: World, frame_time: float, step: Step
    ) -> tuple[Course, float, Array, int]:
        """Course to take; objective and gradient (N,) on that from which the decision set out;
        number of trials run.

        Dofs with different objectives each descend on their own, all from the same course.
        """
        course = self.course(world, frame_time, step)
        size, value, evaluations = course.count, 0.0, 0
        gradient = np.zeros(size)
        scale, slope = world.memory.get("step_scale", np.array([np.ones(size), gradient])).copy()
        limit = self._limit(world.time, frame_time)
        groups = self._groups(world, size)
        for iteration in range(self.iterations):
            displacement = np.zeros(size)
            for indices, wanted in groups:
                trials = self.trials(world, step, course, wanted, indices, scale)
                estimate, slopes = self._estimate(trials)
                if iteration == 0:
                    value, gradient[indices] = value + estimate, slopes
                scale[indices] = self._step_scale(scale[indices], slope[indices], slopes)
                slope[indices] = slopes
                way = scale[indices] * self._step(trials, slopes, limit[indices])
                displacement[indices] = trials.within_range(way)
                evaluations += trials.evaluations
            if not displacement.any():
                break
            course = course.displaced(displacement)
        world.memory["step_scale"] = np.array([scale, slope])
        return course, value, gradient, evaluations

    def _groups(self, world: World, size: int) -> list[tuple[Integers, ObjectiveSum]]:
        """Groups of indices into the numbers (N,) of a course with the same objectives, each with
        their sum. Groups without an active term are left out, except on a plan, where terms can
        become active later."""
        knots = self.dofs.size * np.arange(size // self.dofs.size)[:, None]
        return [
            ((knots + indices).ravel(), wanted)
            for indices, wanted in self.objective.group_by_joints(self.dofs)
            if isinstance(self.hypothesis, Horizon) or wanted.active(world.time)
        ]

    def _estimate(self, trials: Trials) -> tuple[float, Array]:
        """Objective, and its gradient (m,). Raises PartError when the estimate is no such pair."""
        with _guarding("gradient", self.gradient):
            estimate = trials.estimator.estimate(trials)
        value = getattr(estimate, "value", estimate)
        gradient = getattr(estimate, "gradient", estimate)
        asked = "an Estimate of numbers, whose gradient has one"
        (number,) = _numbers("gradient", self.gradient, [value], asked, (1,))
        return float(number), _numbers("gradient", self.gradient, gradient, asked, (trials.count,))

    def _step_scale(self, scale: Array, before: Array, gradient: Array) -> Array:
        """(m,) the part of strength that the rule uses. Raises PartError when it is none."""
        with _guarding("rule", self.rule):
            given = self.rule.step_scale(scale, before, gradient)
        asked = "a scale above 0 and at most 1"
        found = _numbers("rule", self.rule, given, asked, gradient.shape)
        if not ((found > 0.0) & (found <= 1.0)).all():
            raise _wrong("rule", self.rule, given, asked, gradient.shape)
        return found

    def _step(self, trials: Trials, gradient: Array, limit: Array) -> Array:
        """(m,) what the rule says. Raises PartError when that is no such displacement."""
        with _guarding("rule", self.rule):
            given = self.rule.step(trials, gradient, limit)
        asked = "a finite displacement in rad or m"
        return _numbers("rule", self.rule, given, asked, gradient.shape)

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


def _numbers(kind: str, part: object, given: object, asked: str, shape: tuple[int, ...]) -> Array:
    """What a rule or gradient gave, as finite numbers of this shape.

    raises  PartError when it is nothing of the kind
    """
    try:
        found = np.asarray(given, dtype=np.float64)
    except (ArithmeticError, TypeError, ValueError):
        raise _wrong(kind, part, given, asked, shape) from None
    if found.shape != shape or not np.isfinite(found).all():
        raise _wrong(kind, part, given, asked, shape)
    return found


def _wrong(kind: str, part: object, given: object, asked: str, shape: tuple[int, ...]) -> PartError:
    """The error to raise when a rule or gradient gave something else than was asked of it."""
    return PartError(
        f"{kind} {type(part).__name__} gave {given!r:.100}: return {asked} for each of "
        f"{shape[0]} dofs"
    )


def _guarding(kind: str, part: object) -> AbstractContextManager[None]:
    """Context in which a rule or gradient fails as a part; what trials raise is no fault of it."""
    name = f"{kind} {type(part).__name__}"
    return PartError.guarding(name, *BREAKDOWNS, MemoryError)
