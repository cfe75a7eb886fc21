"""The controller with the real step: blocks and a chain in simple wind, and a block in a fluid."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

from flowborne.control.controller import Controller
from flowborne.control.executors import Foreign, Mapper, Processes, Serial, Threads
from flowborne.control.gradients import GradientCentral
from flowborne.control.objective_kinds import (
    ObjectiveEffort,
    ObjectivePressureDrag,
    ObjectiveWindDrag,
)
from flowborne.control.objectives import Objective, ObjectiveSum, WeightedObjective
from flowborne.control.trial import Hypothesis
from flowborne.coupling.step import step
from flowborne.coupling.world import Fluid, Setup, World
from flowborne.fluid.grid import Grid
from flowborne.fluid.state import FluidState
from flowborne.solids.model import SolidModel, SolidState
from flowborne.solids.trajectories import ServoExact
from flowborne.solids.wind import Wind, WindFaces, WindForce

from ..solids.held_pose import holding

FRAME = 1.0 / 24.0
STRENGTH = np.radians(1.0) / FRAME
LENGTH, WIDTH, DENSITY, GRAVITY, SPEED = 1.0, 0.1, 500.0, 9.81, 3.0
BLOCK = f'<geom type="box" size="{LENGTH / 2} {WIDTH / 2} 1" pos="{LENGTH / 2} 0 0"/>'


def chain(links: int) -> str:
    """MJCF of blocks hinged end to end."""
    body = ""
    for link in reversed(range(links)):
        at = LENGTH if link else 0.0
        joint = f'<joint name="j{link}" type="hinge" axis="0 0 1"/>'
        body = f'<body name="b{link}" pos="{at} 0 0">{joint}{BLOCK}{body}</body>'
    return f"<mujoco><worldbody>{body}</worldbody></mujoco>"


def world_of(degrees: list[float], gravity: float, *winds: Wind) -> World:
    """Chain hinged at the origin, at rest, first angle from the x axis and others relative."""
    model = SolidModel.from_string(
        chain(len(degrees)), slab=True, gravity=(0.0, -gravity, 0.0), density=DENSITY
    )
    world = World(Setup(model, winds=winds), solid=model.rest())
    world.solid.q[:] = np.radians(degrees)
    return world


def run(
    world: World, objective: Objective, frames: int, weight: float = 1.0, **options: Any
) -> np.ndarray:
    """(frames + 1, n) controlled angles, degrees."""
    settings: dict[str, Any] = {
        "hypothesis": Hypothesis(FRAME),
        "gradient": GradientCentral(np.radians(3.0)),
        "executor": Serial(),
    }
    controller = Controller(
        np.arange(world.solid.v.size),
        ObjectiveSum.of(objective, weight),
        strength=STRENGTH,
        **settings | options,
    )
    path = [np.degrees(controller.positions(world))]
    for frame in range(frames):
        controller.decide(world, FRAME, step)
        step(world, FRAME, controller.command(world, (frame + 1) * FRAME, FRAME))
        path.append(np.degrees(controller.positions(world)))
    return np.array(path)


@pytest.mark.parametrize("velocities", ["removed", "present"])
@pytest.mark.parametrize("part", [1.0, 0.3])
def test_K1_block_comes_to_rest_along_gravity_and_wind(part: float, velocities: str) -> None:
    weight = DENSITY * LENGTH * WIDTH * GRAVITY
    world = world_of([-60.0], GRAVITY, WindForce((part * weight, 0.0, 0.0)))
    hypothesis = Hypothesis(FRAME, velocities=velocities)  # type: ignore[arg-type]
    path = run(world, ObjectiveEffort(np.array([0])), 40, hypothesis=hypothesis)
    leaning = path[-10:, 0] + 90.0
    assert np.all(np.abs(leaning - np.degrees(np.arctan(part))) <= 0.5 + 1.0)


def test_effort_of_a_trial_is_the_static_torque_times_the_step() -> None:
    world = world_of([-30.0, 20.0], GRAVITY)
    controller = Controller(
        np.arange(2), ObjectiveSum.of(ObjectiveEffort(np.array([0, 1]))), Hypothesis(FRAME), 1.0
    )
    here = np.radians([-30.0, 20.0])
    moves = np.radians([[0.0, 0.0], [7.0, 0.0], [0.0, -12.0]])
    efforts = controller.trials(world, step).values(moves)
    weight = DENSITY * LENGTH * WIDTH * GRAVITY
    for effort, angles in zip(efforts, here + moves, strict=True):
        first, second = np.cos(angles[0]), np.cos(angles.sum())
        elbow = weight * 0.5 * LENGTH * second
        shoulder = weight * (0.5 * first + first) * LENGTH + elbow
        assert effort == pytest.approx(np.hypot(shoulder, elbow) * FRAME, rel=1e-6)


def test_effort_of_a_moving_chain_is_what_holds_its_velocities_in_the_new_pose() -> None:
    """Without what the change of inertia by the trial itself would ask of the drives."""
    world = world_of([-30.0, 20.0], GRAVITY)
    world.solid.v[:] = [0.4, -1.3]
    model, scope = world.setup.solid, np.array([0])
    dt = 1e-5
    hypothesis = Hypothesis(dt, velocities="present")
    controller = Controller(
        np.arange(2), ObjectiveSum.of(ObjectiveEffort(scope)), hypothesis, 1.0, executor=Serial()
    )
    moves = np.radians([[0.0, 0.0], [0.0, 10.0], [0.0, -10.0]])
    efforts = controller.trials(world, step).values(moves)
    for effort, rate in zip(efforts, moves, strict=True):
        there = SolidState(world.solid.q + rate, world.solid.v)
        torque = holding(model, there, np.zeros(2), dt)[0]
        assert effort == pytest.approx(abs(torque) * dt, rel=1e-6)


def test_K3_most_drag_is_across_the_wind() -> None:
    world = world_of([60.0], 0.0, WindFaces((SPEED, 0.0, 0.0), 1.2))
    path = run(world, ObjectiveWindDrag(np.array([1]), (1.0, 0.0, 0.0)), 40, -1.0)
    assert np.all(np.abs(path[-5:, 0] - 90.0) <= 1.0 + 1e-6)


@pytest.mark.parametrize(("weight", "towards"), [(-1.0, 1.0), (1.0, -1.0)])
def test_K4_with_its_velocities_kept_the_block_swings_at_full_strength(
    weight: float, towards: float
) -> None:
    """Most drag: against the wind, which at this pose is counter-clockwise; least: with it."""
    world = world_of([60.0], 0.0, WindFaces((SPEED, 0.0, 0.0), 1.2))
    path = run(
        world,
        ObjectiveWindDrag(np.array([1]), (1.0, 0.0, 0.0)),
        25,
        weight,
        hypothesis=Hypothesis(FRAME, velocities="probe"),
    )
    assert np.diff(path[:, 0]) == pytest.approx(towards, rel=1e-6)


MAPPERS: dict[str, Callable[[], Mapper]] = {
    "threads": lambda: Threads(3),
    "processes": lambda: Processes(2),
    "foreign": lambda: Foreign(ThreadPoolExecutor(2)),
}


@pytest.mark.usefixtures("shared_processes")
@pytest.mark.parametrize("name", list(MAPPERS))
def test_same_bits_whatever_runs_the_trials(name: str) -> None:
    def final(mapper: Mapper) -> dict[str, bytes]:
        world = world_of([-60.0, 15.0, 20.0], GRAVITY, WindFaces((SPEED, 0.0, 0.0), 1.2))
        run(world, ObjectiveEffort(np.arange(3)), 4, executor=mapper)
        mapper.close()
        return {name: values.tobytes() for name, values in world.arrays().items()}

    assert final(MAPPERS[name]()) == final(Serial())


@pytest.mark.usefixtures("shared_processes")
def test_decision_in_a_fluid_leaves_the_world_alone_and_has_the_same_bits() -> None:
    solid = SolidModel.from_string(
        chain(2), slab=True, gravity=(0.0, -GRAVITY, 0.0), density=DENSITY
    )
    fluid = Fluid(Grid.slab(24, 24, 0.25, (-3.0, -3.0)), 1000.0)
    world = World(Setup(solid, fluid), fluid=FluidState.at_rest(fluid.grid), solid=solid.rest())
    world.fluid.velocity[0][8:16, :, 0] = 0.2
    step(world, FRAME, None)
    before = {name: values.tobytes() for name, values in world.arrays().items()}
    decisions = []
    for mapper in (Serial(), Threads(3), Processes(2)):
        controller = Controller(
            np.arange(2),
            ObjectiveSum.of(ObjectivePressureDrag(np.array([1, 2]), (1.0, 0.0, 0.0))),
            Hypothesis(FRAME, steps=2, settle=1),
            1.0,
            executor=mapper,
        )
        copy = world.copy()
        decisions.append(controller.decide(copy, FRAME, step))
        controller.close()
        after = copy.arrays()
        assert {name: after[name].tobytes() for name in before} == before
    assert decisions[0].gradient.any()
    assert len({each.target.tobytes() + each.gradient.tobytes() for each in decisions}) == 1


@pytest.mark.parametrize("limit", [np.inf, 1e6])
def test_a_drive_that_may_give_way_arrives_as_one_that_may_not(limit: float) -> None:
    """Its dof moves with the velocity it has, so it looks one step ahead and does not swing."""
    world = world_of([0.0], 0.0)
    controller = Controller(
        np.array([0]),
        ObjectiveSum.of(ObjectiveEffort(np.array([0]))),
        Hypothesis(FRAME),
        strength=STRENGTH,
        servo=ServoExact(limit),
    )
    path = []
    for _ in range(3):
        world.memory["target"] = world.solid.q + np.radians(1.0)
        world.memory["schedule"] = np.array([0.0, FRAME])
        end = world.time + FRAME
        for _ in range(4):
            step(world, FRAME / 4, controller.command(world, end, FRAME / 4))
        path.append(float(np.degrees(world.solid.q[0])))
    assert path == pytest.approx([1.0, 2.0, 3.0], abs=1e-9)
    for _ in range(6):
        step(world, FRAME / 4, controller.command(world, end, FRAME / 4))
    assert np.degrees(world.solid.q) == pytest.approx(3.0, abs=1e-9)
    assert world.solid.v == pytest.approx(0.0, abs=1e-9)


def test_joints_that_want_different_things_each_follow_their_own() -> None:
    """The shoulder wants its own effort alone; the elbow the sum of its own and the shoulder's."""
    shoulder, elbow = (ObjectiveEffort(np.array([dof])) for dof in (0, 1))
    own = WeightedObjective(shoulder, wanted_by=np.array([0]))
    both = [
        WeightedObjective(o, w, wanted_by=np.array([1])) for o, w in ((shoulder, 0.5), (elbow, 1))
    ]
    world = world_of([-30.0, 20.0], GRAVITY)
    controller = Controller(
        np.arange(2),
        ObjectiveSum((own, *both)),
        Hypothesis(FRAME),
        STRENGTH,
        GradientCentral((np.radians(1.0), np.radians(2.0))),
        executor=Serial(),
    )
    decision = controller.decide(world, FRAME, step)
    d = np.radians([[1.0, 0.0], [-1.0, 0.0], [0.0, 2.0], [0.0, -2.0]])
    efforts = [
        controller.trials(world, step, objective=ObjectiveSum.of(o)).values(d)
        for o in (shoulder, elbow)
    ]
    slope = (efforts[0][0] - efforts[0][1]) / np.radians(2.0)
    mixed = 0.5 * efforts[0] + efforts[1]
    assert decision.gradient == pytest.approx(
        [slope, (mixed[2] - mixed[3]) / np.radians(4.0)], rel=1e-12
    )
    assert np.abs(decision.displacement) == pytest.approx(STRENGTH * FRAME), "both go at full pace"
    assert decision.evaluations == 4


def test_a_joint_that_wants_nothing_is_named() -> None:
    wish = WeightedObjective(ObjectiveEffort(np.array([0])), wanted_by=np.array([0]))
    with pytest.raises(ValueError, match="controlled dof 1 has no objective"):
        ObjectiveSum((wish,)).group_by_joints(np.array([0, 1]))
