"""One hypothetical evaluation: what moves, what holds, what is measured, what is left alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from flowborne.control import trial
from flowborne.control.controller import Controller
from flowborne.control.course import TrialError, Trials
from flowborne.control.executors import Serial
from flowborne.control.gradients import GradientCentral
from flowborne.control.measurement import Measurement
from flowborne.control.objectives import ObjectiveCallable, ObjectiveSum
from flowborne.control.phases import PhaseIntervals
from flowborne.control.trial import Hypothesis, PoseCourse, without_scalars
from flowborne.coupling import step as stepping
from flowborne.coupling.report import Outcome, StepReport
from flowborne.coupling.world import World
from flowborne.scenes.build import build
from flowborne.scenes.load import load_scene
from flowborne.sim.simulation import Simulation
from flowborne.solids.trajectories import JointCommand

MakeWorld = Callable[..., World]
Step = Callable[[World, float, JointCommand | None], StepReport]
SHOULDER = np.array([0])


@dataclass
class Recorder:
    """A step that keeps what it was asked and what it left."""

    step: Step
    commands: list[JointCommand] = field(default_factory=list)
    before: list[np.ndarray] = field(default_factory=list)
    worlds: list[World] = field(default_factory=list)

    def __call__(self, world: World, dt: float, command: JointCommand | None = None) -> StepReport:
        self.commands.append(
            JointCommand(
                command.prescribed.copy(),
                command.rate.copy(),
                command.final_velocity.copy(),
                command.torque_limit,
            )
        )
        self.before.append(world.solid.v.copy())
        report = self.step(world, dt, command)
        self.worlds.append(world.copy())
        return report


def angle(measurement: Measurement) -> float:
    return float(measurement.world.solid.q[0])


ANGLE = ObjectiveSum.of(ObjectiveCallable(angle))


def value_of(
    world: World,
    step: Step,
    hypothesis: Hypothesis,
    dofs: np.ndarray,
    displacement: list[float],
    objective: ObjectiveSum = ANGLE,
) -> float:
    course = PoseCourse(world, step, hypothesis, dofs, world.solid.q.copy())
    return course.evaluate(objective, np.array(displacement))


@pytest.fixture
def every_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """Steps whose forces nobody reads are taken like all others, so that they can be recorded."""
    monkeypatch.setattr(trial, "advance_prescribed", lambda world, dt, command: False)


@pytest.mark.usefixtures("every_step")
def test_K7_displacement_is_exact_over_any_number_of_steps(
    make_world: MakeWorld, step: Step
) -> None:
    world = make_world()
    world.solid.q[:] = [0.3, -0.2, 0.1]
    for steps, settle in ((1, 0), (3, 0), (4, 5)):
        recorder = Recorder(step)
        hypothesis = Hypothesis(0.02, steps, settle)
        value = value_of(world, recorder, hypothesis, SHOULDER, [0.17])
        assert value == pytest.approx(0.47, abs=1e-14)
        assert len(recorder.worlds) == steps + settle
        assert recorder.worlds[-1].solid.q == pytest.approx([0.47, -0.2, 0.1], abs=1e-14)
        assert recorder.worlds[-1].time == pytest.approx(0.02 * (steps + settle))


def test_outboard_joints_are_rigid_and_others_free(make_world: MakeWorld, step: Step) -> None:
    world = make_world()
    world.solid.v[:] = [0.5, 0.6, 0.7]
    recorder = Recorder(step)
    value_of(world, recorder, Hypothesis(0.1), np.array([1]), [0.2])
    command = recorder.commands[0]
    assert command.prescribed.tolist() == [False, True, True]
    assert command.rate == pytest.approx([0.0, 2.0, 0.0])
    assert np.all(np.isinf(command.torque_limit))


@pytest.mark.usefixtures("every_step")
@pytest.mark.parametrize(
    ("velocities", "shoulder", "elbow"),
    [("removed", 0.0, 0.0), ("present", 0.5, 0.6), ("probe", 4.0, 0.0)],
)
def test_velocities_that_are_held_are_there_from_the_first_step(
    make_world: MakeWorld, step: Step, velocities: str, shoulder: float, elbow: float
) -> None:
    """So no drive's force holds an acceleration of the probe's own."""
    world = make_world()
    world.solid.v[:] = [0.5, 0.6, 0.7]
    recorder = Recorder(step)
    hypothesis = Hypothesis(0.05, 2, 3, velocities)  # type: ignore[arg-type]
    value_of(world, recorder, hypothesis, np.array([0, 1]), [0.4, 0.0])
    expected = [shoulder, elbow, 0.0]
    for before, command in zip(recorder.before, recorder.commands, strict=True):
        assert command.final_velocity == pytest.approx(expected, abs=1e-12)
        assert before == pytest.approx(expected, abs=1e-12)
    moves = np.array([command.rate[:2] for command in recorder.commands])
    last = np.array([shoulder, elbow]) * (velocities == "present")
    assert moves[2:] == pytest.approx(np.tile(last, (3, 1)), abs=1e-12)
    assert moves[:2] == pytest.approx(np.tile([4.0, 0.0] - 1.5 * last, (2, 1)), abs=1e-12)
    assert recorder.worlds[-1].solid.q == pytest.approx([0.4, 0.0, 0.0], abs=1e-12)


@pytest.mark.parametrize(
    ("name", "skipped"), [("human-wind-all", True), ("human-gravity-arms", True), ("eel", False)]
)
def test_steps_before_the_last_ask_for_no_forces_where_all_is_told(
    name: str, skipped: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And change no bit of the objective. An eel that floats answers the forces on it."""
    coarse = {"domain.resolution": "32"} if name == "eel" else {}
    simulation = Simulation(load_scene(name, coarse), workers=1)
    world, controller = simulation.world, simulation.controller
    if controller is None:
        controller = Controller(
            np.array([world.setup.solid.nv - 1]),
            ObjectiveSum.of(ObjectiveCallable(angle)),
            Hypothesis(0.01, 2),
            1.0,
        )
    moves = np.zeros((2, controller.dofs.size))
    moves[1] = 0.02
    recorder = Recorder(stepping.step)
    quick = controller.trials(world, recorder).values(moves)
    assert len(recorder.worlds) == 2 * (1 if skipped else controller.hypothesis.steps)
    monkeypatch.setattr(trial, "advance_prescribed", lambda world, dt, command: False)
    assert controller.trials(world, stepping.step).values(moves).tobytes() == quick.tobytes()


def test_trial_starts_from_its_pose_and_leaves_the_world_alone(
    make_world: MakeWorld, step: Step
) -> None:
    world = make_world()
    world.solid.v[:] = 1.0 / 3.0
    world.memory["target"] = np.array([1.0, 2.0, 3.0])
    before = {name: values.tobytes() for name, values in world.arrays().items()}
    trials = Trials(
        PoseCourse(world, step, Hypothesis(0.1), SHOULDER, np.array([0.5, 0.0, 0.0])),
        ObjectiveSum.of(ObjectiveCallable(angle)),
        GradientCentral(0.1),
        Serial(),
        np.array([0]),
    )
    values = trials.values(np.array([[0.1], [-0.2]]))
    assert values == pytest.approx([0.6, 0.3], abs=1e-14)
    assert trials.evaluations == 2
    assert trials.gradient(np.array([0.3])) == pytest.approx([1.0])
    assert trials.evaluations == 4
    assert {name: values.tobytes() for name, values in world.arrays().items()} == before


def test_trial_in_a_flow_leaves_it_alone_and_needs_no_dye() -> None:
    scene = load_scene("ns-block-drag-max", {"domain.resolution": "16"})
    world, controller = build(scene)
    assert controller is not None
    for _ in range(3):
        stepping.step(world, scene.frame_time)
    before = {name: values.tobytes() for name, values in world.arrays().items()}
    assert world.flow()[1].scalars["dye"].any()
    trials = controller.trials(world, stepping.step)
    value = trials.values(np.array([[0.1]]))
    assert {name: values.tobytes() for name, values in world.arrays().items()} == before
    dyed = PoseCourse(world, stepping.step, controller.hypothesis, controller.dofs, world.solid.q)
    assert dyed.evaluate(controller.objective, np.array([0.1])) == value
    assert without_scalars(world).flow()[1].scalars == {}


def test_phases_are_those_of_the_decision(make_world: MakeWorld, step: Step) -> None:
    """Not of the hypothetical future, which may already be another phase."""
    world = make_world()
    early = PhaseIntervals(((0.0, 0.3),))
    term = ANGLE.terms[0]
    phased = ObjectiveSum((type(term)(term.objective, 2.0, early),))
    value = value_of(world, step, Hypothesis(0.5), SHOULDER, [0.2], phased)
    assert value == pytest.approx(0.4)


@pytest.mark.parametrize("outcome", [Outcome.NOT_FINITE, Outcome.ADVECTION_NOT_FINITE])
def test_blown_up_trial_says_what_was_tried(
    make_world: MakeWorld, step: Step, outcome: Outcome
) -> None:
    def blow_up(world: World, dt: float, command: JointCommand | None = None) -> StepReport:
        return replace(step(world, dt, command), outcome=outcome)

    with pytest.raises(
        TrialError, match=rf"shoulder by 0\.25 at time 0 s, {outcome.value}; try a smaller"
    ):
        value_of(make_world(), blow_up, Hypothesis(0.1), SHOULDER, [0.25])
    nothing = ObjectiveSum.of(ObjectiveCallable(lambda m: np.nan))
    with pytest.raises(TrialError, match="the objective is nan"):
        value_of(make_world(), step, Hypothesis(0.1), SHOULDER, [0.25], nothing)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((0.0,), "step is 0.0 s"),
        ((0.1, 0), "steps are 0"),
        ((0.1, 1, -1), "-1 to settle"),
        ((0.1, 1, 0, "kept"), "'kept'"),
    ],
)
def test_bad_hypotheses_are_refused(arguments: tuple, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Hypothesis(*arguments)
