"""Plans: how joints go along them, what a trial makes of them, and what a decision leaves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from flowborne.control.controller import Controller
from flowborne.control.course import TrialError
from flowborne.control.creature import approach
from flowborne.control.executors import Serial
from flowborne.control.gradients import GradientCentral
from flowborne.control.measurement import Measurement
from flowborne.control.objective_kinds import ObjectiveInputMotion
from flowborne.control.objectives import ObjectiveCallable, ObjectiveSum, WeightedObjective
from flowborne.control.phases import PhaseIntervals
from flowborne.control.plan import Horizon, PlanCourse
from flowborne.control.rules import QuasiNewton
from flowborne.coupling import step as stepping
from flowborne.coupling.report import Outcome, StepReport
from flowborne.coupling.world import World
from flowborne.kernels.arrays import Integers
from flowborne.motion.tracks import TrajectoryConstant
from flowborne.solids.trajectories import JointCommand, ServoExact

MakeWorld = Callable[..., World]
Step = Callable[[World, float, JointCommand | None], StepReport]
SHOULDER = np.array([0])
ARM = np.array([0, 1])


def angle(measurement: Measurement) -> float:
    return float(measurement.world.solid.q[0])


def course_of(
    world: World, step: Step, moves: list[list[float]], most: float = 1.0, dofs: Integers = ARM
) -> PlanCourse:
    """A plan of these moves from knot to knot, two steps of 0.1 s apart."""
    given = np.array(moves).ravel()
    horizon = Horizon(0.1, 2, len(moves))
    return PlanCourse(world, step, horizon, dofs, ServoExact(), np.full(given.size, most), given)


def test_a_rehearsal_goes_from_pose_to_pose_at_steady_rates(
    make_world: MakeWorld, step: Step
) -> None:
    world, seen = make_world(), []

    def noted(measurement: Measurement) -> float:
        seen.append(np.concatenate([measurement.world.solid.q[:2], measurement.world.solid.v[:2]]))
        return angle(measurement)

    course = course_of(world, step, [[0.2, -0.4], [-0.1, 0.6]])
    objective = ObjectiveSum.of(ObjectiveCallable(noted))
    value = course.evaluate(objective, np.array([0.0, 0.0, 0.1, 0.0]))
    expected = [
        [0.1, -0.2, 1.0, -2.0],
        [0.2, -0.4, 1.0, -2.0],
        [0.2, -0.1, 0.0, 3.0],
        [0.2, 0.2, 0.0, 3.0],
    ]
    assert np.array(seen) == pytest.approx(np.array(expected), abs=1e-13)
    assert value == pytest.approx(0.7 / 4, abs=1e-14)
    assert course.goal[:2] == pytest.approx([0.2, -0.4], abs=1e-14)


def test_a_plan_keeps_within_strength_and_ranges(make_world: MakeWorld, step: Step) -> None:
    """At an end of its range a joint may still be asked what a turn back is worth."""
    world = make_world(limited=True)
    world.solid.q[0] = 0.9
    course = course_of(world, step, [[0.1], [0.0], [0.0]], 0.25, SHOULDER)
    assert course.within_range(np.array([0.2, 0.2, -0.6])) == pytest.approx([0.15, 0.05, -0.25])
    full = course.displaced(course.within_range(np.ones(3)))
    assert full.moves == pytest.approx([0.25, 0.05, 0.0])
    assert full.within_range(np.full(3, 0.1)) == pytest.approx(0.0, abs=1e-14)
    inward = np.array([0.0, 0.0, -0.1])
    assert full.within_range(inward) == pytest.approx(inward)


def test_a_ball_joint_stays_within_its_cone_on_a_plan(make_world: MakeWorld, step: Step) -> None:
    world, dofs = make_world(ball=True, limited=True), np.arange(3)
    course = course_of(world, step, [[0.2, 0.4, 0.0], [0.4, -0.6, 0.2]], 1.0, dofs)
    poses = np.array([pose for _, pose in course.poses(course.moves + 0.3)])
    assert len(poses) == 2
    assert np.all(2.0 * np.arccos(np.minimum(np.abs(poses[:, 0]), 1.0)) <= 0.7 + 1e-9)


def test_a_rehearsal_is_what_the_world_then_does(make_world: MakeWorld) -> None:
    """Bodies with a free wrist: the mean over the plan, bit for bit, and the world left alone."""
    world = make_world()
    world.solid.v[:] = [0.3, -0.5, 0.4]
    before = {name: values.tobytes() for name, values in world.arrays().items()}
    wrist = ObjectiveSum.of(ObjectiveCallable(lambda m: float(m.world.solid.q[2])))
    course = course_of(world, stepping.step, [[0.3, -0.1], [0.0, 0.2]])
    found = course.evaluate(wrist, np.zeros(4))
    assert {name: values.tobytes() for name, values in world.arrays().items()} == before
    angles = []
    target = world.solid.q.copy()
    for move in course.moves.reshape(2, 2):
        target[:2] += move
        for left in (0.2, 0.1):
            stepping.step(world, 0.1, approach(world, ARM, ServoExact(), target, left, 0.1))
            angles.append(float(world.solid.q[2]))
    assert found == sum(angles) / 4.0
    assert abs(found) > 1e-3


def test_terms_count_while_their_phases_are_on(make_world: MakeWorld, step: Step) -> None:
    """At the time of each step of the plan, not of the decision."""
    late = WeightedObjective(
        ObjectiveCallable(lambda _: 8.0), 1.0, PhaseIntervals(((0.25, 0.45),), None)
    )
    course = course_of(make_world(), step, [[0.0], [0.0]], dofs=SHOULDER)
    assert course.evaluate(ObjectiveSum((late,)), np.zeros(2)) == pytest.approx(8.0 * 2 / 4)


def planner(every: int = 2, **settings: object) -> Controller:
    """Of two joints that want to be close to angles, on plans of three knots of two frames."""
    near = [
        WeightedObjective(
            ObjectiveInputMotion(np.array([dof]), TrajectoryConstant(np.array([dof]), place))
        )
        for dof, place in enumerate((0.5, -0.1))
    ]
    chosen: dict[str, object] = {"gradient": GradientCentral(0.01), "executor": Serial()}
    return Controller(
        ARM,
        ObjectiveSum(tuple(near)),
        Horizon(0.1, every, 3),
        (1.0, 2.0),
        every=every,
        **(chosen | settings),  # type: ignore[arg-type]
    )


def test_a_plan_is_the_least_that_strength_allows(make_world: MakeWorld, step: Step) -> None:
    """The mean square of a distance is a quadratic of the moves: bounded least squares has it."""
    world = make_world()
    controller = planner(rule=QuasiNewton(60))
    decision = controller.decide(world, 0.1, step)
    halves = np.kron(np.tril(np.ones((3, 3)), -1), np.ones((2, 1)))
    halves += np.kron(np.eye(3), np.array([[0.5], [1.0]]))
    for joint, (place, strength) in enumerate(((0.5, 1.0), (-0.1, 2.0))):
        best = lsq_linear(halves, np.full(6, place), (-0.2 * strength, 0.2 * strength)).x
        assert world.memory["plan"][:, joint] == pytest.approx(best, abs=1e-3)
    assert decision.target[:2] == pytest.approx(world.memory["plan"][0], abs=1e-14)
    assert decision.gradient.shape == (2,)
    assert decision.evaluations > 12


def test_the_next_decision_sets_out_from_what_is_left(make_world: MakeWorld, step: Step) -> None:
    world, controller = make_world(), planner()
    for frame in range(6):
        decision = controller.decide(world, 0.1, step)
        assert decision.decided == (frame % 2 == 0)
        for _ in range(2):
            step(world, 0.05, controller.command(world, 0.1 * (frame + 1), 0.05))
        if frame % 2:
            assert world.solid.q == pytest.approx(decision.target, abs=1e-12)
            course = controller.course(world, 0.1, step)
            assert isinstance(course, PlanCourse)
            moves = course.moves.reshape(3, 2)
            assert moves[:-1] == pytest.approx(world.memory["plan"][1:], abs=1e-14)
            assert moves[-1] == pytest.approx(0.0, abs=1e-14)


def test_rates_stay_within_strength(make_world: MakeWorld, step: Step) -> None:
    world, controller = make_world(), planner()
    for frame in range(8):
        controller.decide(world, 0.1, step)
        step(world, 0.1, controller.command(world, 0.1 * (frame + 1), 0.1))
        assert np.all(np.abs(world.memory["plan"]) <= 0.2 * np.array([1.0, 2.0]) + 1e-12)
        assert np.all(np.abs(world.solid.v[:2]) <= np.array([1.0, 2.0]) + 1e-12)


def test_of_joints_that_want_different_things_each_plans_its_own(
    make_world: MakeWorld, step: Step
) -> None:
    world, controller = make_world(), planner(rule=QuasiNewton(60))
    controller.decide(world, 0.1, step)
    together = world.memory["plan"]
    first, second = controller.objective.terms
    terms = replace(first, wanted_by=ARM[:1]), replace(second, wanted_by=ARM[1:])
    world, controller = make_world(), replace(controller, objective=ObjectiveSum(terms))
    controller.decide(world, 0.1, step)
    assert world.memory["plan"] == pytest.approx(together, abs=1e-3)


def test_a_plan_is_part_of_the_world(make_world: MakeWorld, step: Step) -> None:
    world, controller = make_world(), planner()
    controller.decide(world, 0.1, step)
    assert any("plan" in name for name in world.arrays())
    copy = world.copy()
    copy.memory["plan"][:] = 0.0
    assert world.memory["plan"].any()


def test_a_plan_that_blows_up_says_when_it_was_made(make_world: MakeWorld) -> None:
    def broken(world: World, dt: float, command: JointCommand | None = None) -> StepReport:
        return replace(stepping.step(world, dt, command), outcome=Outcome.NOT_FINITE)

    course = course_of(make_world(), broken, [[0.0]], dofs=SHOULDER)
    with pytest.raises(TrialError, match=r"step of 0\.1 s that follows a plan made at time 0 s, a"):
        course.evaluate(ObjectiveSum.of(ObjectiveCallable(angle)), np.zeros(1))


@pytest.mark.parametrize(("dt", "steps", "knots"), [(0.0, 1, 1), (0.1, 0, 1), (0.1, 1, 0)])
def test_a_horizon_says_what_is_wrong(dt: float, steps: int, knots: int) -> None:
    with pytest.raises(ValueError, match="give"):
        Horizon(dt, steps, knots)
