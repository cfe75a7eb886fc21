"""The controller on objectives whose optimum is known."""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from flowborne.control.controller import Controller, StrengthInPhase
from flowborne.control.executors import Serial
from flowborne.control.gradients import GradientCentral, GradientOneSided
from flowborne.control.measurement import Measurement
from flowborne.control.objectives import ObjectiveCallable, ObjectiveSum, WeightedObjective
from flowborne.control.phases import PhaseIntervals
from flowborne.control.rules import GoldenSection
from flowborne.control.trial import Hypothesis
from flowborne.coupling.report import StepReport
from flowborne.coupling.world import World
from flowborne.solids.trajectories import JointCommand, ServoExact, ServoPD

MakeWorld = Callable[..., World]
Step = Callable[[World, float, JointCommand | None], StepReport]
FRAME, SUBSTEPS = 1.0 / 24.0, 4


@dataclass(frozen=True)
class Distance:
    """Distance of the scalar joints from an optimum, to a power."""

    optimum: tuple[float, ...]
    power: float = 2.0

    def __call__(self, measurement: Measurement) -> float:
        q = measurement.world.solid.q[: len(self.optimum)]
        return float(np.sum(np.abs(q - self.optimum) ** self.power))


def controller_of(
    optimum: tuple[float, ...] = (0.7,), strength: Any = 1.0, power: float = 2.0, **options: Any
) -> Controller:
    settings: dict[str, Any] = {
        "dofs": np.arange(len(optimum)),
        "objective": ObjectiveSum.of(ObjectiveCallable(Distance(optimum, power))),
        "hypothesis": Hypothesis(FRAME),
        "strength": strength,
        "gradient": GradientCentral(0.02),
        "executor": Serial(),
    }
    return Controller(**settings | options)


def advance(controller: Controller, world: World, step: Step, frames: int) -> np.ndarray:
    """(frames + 1, n) positions of the controlled joints at the ends of frames."""
    path = [controller.positions(world)]
    for frame in range(frames):
        controller.decide(world, FRAME, step)
        for _ in range(SUBSTEPS):
            dt = FRAME / SUBSTEPS
            step(world, dt, controller.command(world, (frame + 1) * FRAME, dt))
        path.append(controller.positions(world))
    return np.array(path)


@pytest.mark.parametrize("power", [1.0, 2.0, 4.0])
@pytest.mark.parametrize("strength", [0.5, 1.0, 2.0, 4.0])
def test_K6_frames_to_the_optimum(
    make_world: MakeWorld, step: Step, strength: float, power: float
) -> None:
    """One fixed rate whatever the slope; N times strength constant; chatter within a step."""
    start, optimum = -0.9, 0.7
    world = make_world()
    world.solid.q[0] = start
    stride = strength * FRAME
    expected = math.ceil((optimum - start) / stride)
    path = advance(controller_of((optimum,), strength, power), world, step, expected + 20)[:, 0]
    off = np.abs(path - optimum)
    arrived = int(np.argmax(off <= stride))
    assert abs(arrived - expected) <= 1
    assert np.diff(path[: arrived + 1]) == pytest.approx(stride, abs=1e-12)
    assert np.all(off[arrived:] <= stride * (1.0 + 1e-9))
    assert abs(np.mean(path[-20:]) - optimum) <= 0.5 * stride


def test_a_joint_is_weaker_while_a_phase_is_on(make_world: MakeWorld, step: Step) -> None:
    """Frames 4 to 7 go half as far, for the dof that is named; the last entry that is on counts."""
    slow = PhaseIntervals(((4.0 * FRAME, 8.0 * FRAME),))
    first = StrengthInPhase((0, 1), 5.0, PhaseIntervals(((6.0 * FRAME, 8.0 * FRAME),)))
    weak = StrengthInPhase((0,), 1.0, slow)
    controller = controller_of((0.7, 0.7), 2.0, 1.0, in_phases=(first, weak))
    world = make_world()
    world.solid.q[:2] = -0.9
    assert controller.strength_at(world.time).tolist() == [2.0, 2.0]
    assert controller.greatest_strength().tolist() == [5.0, 5.0]
    pace = np.diff(advance(controller, world, step, 8), axis=0) / FRAME
    assert pace[:4] == pytest.approx(2.0)
    assert pace[4:6] == pytest.approx(np.array([[1.0, 1.0]] * 2))
    assert controller.strength_at(7.0 * FRAME).tolist() == [1.0, 5.0]


def test_target_is_reached_exactly_at_the_end_of_the_frame(
    make_world: MakeWorld, step: Step
) -> None:
    world, controller = make_world(), controller_of((0.7, -0.4), (1.0, 3.0))
    for frame in range(5):
        decision = controller.decide(world, FRAME, step)
        start = controller.positions(world)
        for _ in range(SUBSTEPS):
            command = controller.command(world, (frame + 1) * FRAME, FRAME / SUBSTEPS)
            assert command.rate[:2] == pytest.approx(decision.displacement / FRAME, rel=1e-9)
            assert np.array_equal(command.rate, command.final_velocity)
            assert command.prescribed.tolist() == [True, True, False]
            step(world, FRAME / SUBSTEPS, command)
        assert controller.positions(world) == pytest.approx(controller.targets(world), abs=1e-13)
        moved = controller.positions(world) - start
        assert moved == pytest.approx(decision.displacement, abs=1e-13)
        effort = np.abs(decision.displacement) / (np.array([1.0, 3.0]) * FRAME)
        assert effort.max() == pytest.approx(1.0)


def test_no_gradient_no_move(make_world: MakeWorld, step: Step) -> None:
    """At a symmetric optimum there is no gradient, and rounding is not taken for one."""
    world = make_world()
    world.solid.q[0] = 0.7
    decision = controller_of((0.7,), power=1.0).decide(world, FRAME, step)
    assert decision.decided
    assert decision.evaluations == 2
    assert not decision.displacement.any()
    command = controller_of().command(world, FRAME, FRAME)
    assert command.prescribed[0]
    assert not command.rate.any()


def test_range_keeps_targets_inside(make_world: MakeWorld, step: Step) -> None:
    world = make_world(limited=True)
    path = advance(controller_of((5.0,), 3.0), world, step, 20)[:, 0]
    assert path.max() == pytest.approx(1.2, abs=1e-12)
    assert path[-1] == path.max()


def test_a_blocked_joint_does_not_wind_up(make_world: MakeWorld, step: Step) -> None:
    """Targets start from where the joint is, not from where it was told to be."""
    world, controller = make_world(), controller_of((0.9,), 1.0)
    for frame in range(10):
        controller.decide(world, FRAME, step)
        controller.command(world, (frame + 1) * FRAME, FRAME)
        world.time += FRAME  # an obstacle keeps the arm where it is
    assert controller.targets(world)[0] - controller.positions(world)[0] <= FRAME * (1.0 + 1e-12)


def test_deciding_every_third_frame_spreads_its_step_evenly(
    make_world: MakeWorld, step: Step
) -> None:
    world, controller = make_world(), controller_of((0.7,), 1.0, every=3)
    decided = []
    path = [0.0]
    for frame in range(7):
        decision = controller.decide(world, FRAME, step)
        decided.append(decision.decided)
        assert decision.evaluations == (2 if decision.decided else 0)
        assert decision.displacement == pytest.approx([3 * FRAME])
        for _ in range(SUBSTEPS):
            command = controller.command(world, (frame + 1) * FRAME, FRAME / SUBSTEPS)
            step(world, FRAME / SUBSTEPS, command)
        path.append(world.solid.q[0])
    assert decided == [True, False, False, True, False, False, True]
    assert np.diff(path) == pytest.approx(FRAME, abs=1e-12)


def test_iterations_descend_in_the_frozen_world(make_world: MakeWorld, step: Step) -> None:
    """Infinite strength: several steps in one decision, each from the pose found so far."""
    world = make_world()
    decision = controller_of((0.7,), 1.0, iterations=5).decide(world, FRAME, step)
    assert decision.displacement == pytest.approx([5 * FRAME])
    assert decision.evaluations == 10
    assert decision.objective == pytest.approx(0.7**2, rel=1e-2)
    assert decision.gradient == pytest.approx([-1.4])
    search = controller_of((0.7,), 100.0, iterations=4, rule=GoldenSection(tolerance=1e-6))
    found = search.decide(world, FRAME, step)
    assert found.target[0] == pytest.approx(0.7, abs=1e-4)


def test_golden_section_has_no_chatter(make_world: MakeWorld, step: Step) -> None:
    controller = controller_of((0.7,), 1.0, rule=GoldenSection(tolerance=1e-3))
    path = advance(controller, make_world(), step, 25)[:, 0]
    assert np.abs(path[18:] - 0.7).max() < 1e-3 * FRAME


def test_phases_turn_the_creature_round(make_world: MakeWorld, step: Step) -> None:
    """Most of something on the downstroke, least on the upstroke, nothing in a pause."""
    height = ObjectiveCallable(Distance((3.0,)))
    period = 12 * FRAME
    terms = (
        WeightedObjective(height, -1.0, PhaseIntervals(((0.0, 4 * FRAME),), period)),
        WeightedObjective(height, 1.0, PhaseIntervals(((4 * FRAME, 8 * FRAME),), period)),
    )
    controller = controller_of(strength=1.0, objective=ObjectiveSum(terms))
    path = advance(controller, make_world(), step, 24)[:, 0]
    signs = np.rint(np.diff(path) / FRAME)
    assert signs.tolist() == 2 * ([-1.0] * 4 + [1.0] * 4 + [0.0] * 4)


def test_several_dofs_come_to_the_weighted_optimum(make_world: MakeWorld, step: Step) -> None:
    first, second = ObjectiveCallable(Distance((0.6, 0.2))), ObjectiveCallable(Distance((0.0, 0.8)))
    total = ObjectiveSum((WeightedObjective(first, 2.0), WeightedObjective(second, 1.0)))
    controller = controller_of((0.0, 0.0), 1.0, objective=total, rule=GoldenSection(tolerance=1e-3))
    path = advance(controller, make_world(), step, 40)
    assert path[-1] == pytest.approx([0.4, 0.4], abs=1e-3)


def test_ball_joint_turns_to_its_optimum(make_world: MakeWorld, step: Step) -> None:
    wanted = np.array([0.1, -0.5, 0.3])

    def misfit(measurement: Measurement) -> float:
        model = measurement.world.setup.solid
        target = model.integrate(model.rest().q, wanted, 1.0)
        return 1.0 - abs(float(measurement.world.solid.q @ target))

    controller = controller_of(
        (0.0, 0.0, 0.0),
        1.0,
        objective=ObjectiveSum.of(ObjectiveCallable(misfit)),
        rule=GoldenSection(tolerance=1e-3),
    )
    world = make_world(ball=True)
    advance(controller, world, step, 30)
    model = world.setup.solid
    assert abs(world.solid.q @ model.integrate(model.rest().q, wanted, 1.0)) > 1.0 - 1e-7
    assert np.all(np.isnan(controller.positions(world)))


def test_pd_servo_approaches_without_overshoot(make_world: MakeWorld, step: Step) -> None:
    servo = ServoPD(40.0, torque_limit=(2.5,))
    world, controller = make_world(), controller_of((0.7,), 1.0, servo=servo)
    path = advance(controller, world, step, 80)[:, 0]
    assert path.max() <= 0.7 + FRAME
    assert abs(path[-1] - 0.7) <= FRAME
    command = controller.command(world, world.time + FRAME, FRAME)
    assert command.torque_limit.tolist() == [2.5, np.inf, np.inf]


def test_torque_limit_passes_through(make_world: MakeWorld) -> None:
    controller = controller_of((0.1, 0.2), servo=ServoExact(torque_limit=7.0))
    command = controller.command(make_world(), FRAME, FRAME)
    assert command.torque_limit.tolist() == [7.0, 7.0, np.inf]


def test_decision_touches_nothing_but_memory(make_world: MakeWorld, step: Step) -> None:
    world = make_world()
    world.solid.v[:] = 0.1
    before = {name: values.tobytes() for name, values in world.arrays().items()}
    controller_of((0.3, 0.4), iterations=3, rule=GoldenSection()).decide(world, FRAME, step)
    after = world.arrays()
    assert {name: after[name].tobytes() for name in before} == before
    names = ("target", "displacement", "gradient", "objective", "step_scale", "schedule")
    assert set(after) - set(before) == {f"memory/{name}" for name in names}


def test_memory_is_all_that_the_controller_remembers(make_world: MakeWorld, step: Step) -> None:
    """A world saved in the middle goes on with the same numbers, by another controller."""
    world = make_world()
    advance(controller_of((0.7, 0.1), every=3), world, step, 4)
    saved = World.from_arrays(world.setup, {k: v.copy() for k, v in world.arrays().items()})
    for each in (world, saved):
        again = pickle.loads(pickle.dumps(controller_of((0.7, 0.1), every=3)))
        for frame in range(4, 8):
            again.decide(each, FRAME, step)
            step(each, FRAME, again.command(each, (frame + 1) * FRAME, FRAME))
    left, right = world.arrays(), saved.arrays()
    assert {k: v.tobytes() for k, v in left.items()} == {k: v.tobytes() for k, v in right.items()}


def test_measure_gives_the_terms_without_their_weights(make_world: MakeWorld, step: Step) -> None:
    world = make_world()
    term = WeightedObjective(ObjectiveCallable(Distance((0.7,)), "distance"), -2.0)
    controller = replace(controller_of((0.7,)), objective=ObjectiveSum((term,)))
    report = step(world, FRAME, None)
    assert controller.measure(world, report) == pytest.approx({"distance": 0.49})


def test_one_sided_differences_decide_alike(make_world: MakeWorld, step: Step) -> None:
    decision = controller_of((0.7, 0.2), gradient=GradientOneSided(1e-4)).decide(
        make_world(), FRAME, step
    )
    assert decision.evaluations == 3
    assert decision.objective == pytest.approx(0.53)
    assert decision.gradient == pytest.approx([-1.4, -0.4], abs=2e-4)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"dofs": np.array([], int)}, "controlled dofs are"),
        ({"dofs": np.array([1, 1])}, "each once"),
        ({"strength": 0.0}, "strength is 0"),
        ({"strength": (1.0, 2.0)}, "strength has 2 values for 1"),
        ({"servo": ServoExact((1.0, 2.0))}, "torque_limit has 2 values for 1"),
        ({"every": 0}, "every is 0"),
        ({"iterations": 0}, "iterations 0"),
    ],
)
def test_bad_controllers_are_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        controller_of(**options)
