"""What a history says of joints and their drives."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import flowborne as fb
from flowborne.bodies import SolidState, TrajectorySinusoid, kinetic_energy, potential_energy
from flowborne.scenes.build import build
from flowborne.sim.columns import Columns
from flowborne.worlds import make_world
from flowborne_validation.worlds import mjcf

NOTHING = np.zeros(0, np.int64)
PERIOD = 0.8

CART = mjcf(
    '<body name="cart"><joint name="rail" type="slide" axis="1 0 0"/>'
    '<geom type="box" size="0.2 0.1 0.1" mass="2"/>'
    '<body name="arm"><joint name="elbow" axis="0 0 1"/>'
    '<geom type="box" size="0.05 0.5 0.1" pos="0 -0.5 0" mass="1"/></body></body>'
)
BALL = mjcf(
    '<body name="stick"><joint name="shoulder" type="ball"/>'
    '<geom type="sphere" size="0.1" pos="1 0 0" mass="3"/></body>'
)


def frame_of(world: fb.World, dt: float, steps: int) -> fb.FrameReport:
    """What a frame of so many steps does, without a controller."""
    taken = tuple(fb.step(world, dt) for _ in range(steps))
    return fb.FrameReport(1, world.time, taken, np.nan, {}, NOTHING, NOTHING, False, {})


def energy(world: fb.World, dt: float) -> float:
    """Energy half a step after the end of a frame, where the velocities are, J."""
    model, solid = world.setup.solid, world.solid
    state = SolidState(model.integrate(solid.q, solid.v, 0.5 * dt), solid.v)
    return kinetic_energy(model, state) + potential_energy(model, state)


def missing_energy(steps: int) -> float:
    """Energy that a driven cart gains in half a period with no work of its drive to show, J."""
    drive = TrajectorySinusoid(np.array([0]), 0.3, PERIOD)
    world = make_world(CART, slab=False, gravity=(0.0, -9.81, 0.0), motions=(drive,))
    columns = Columns(world.setup)
    frame_time, dt = PERIOD / 40, PERIOD / 40 / steps
    frame_of(world, dt, steps)
    before, work = energy(world, dt), 0.0
    for _ in range(20):
        frame = frame_of(world, dt, steps)
        row = columns.values(fb.Snapshot(world, 1, frame))
        assert frame_time * row["power_rail_W"] == pytest.approx(sum(s.work for s in frame.steps))
        work += frame_time * row["power_rail_W"]
    assert abs(work) > 0.5
    return abs(energy(world, dt) - before - work)


def test_power_over_time_is_the_work_that_changes_the_energy() -> None:
    """A driven cart with a free pendulum; what is missing is of second order in the step."""
    coarse, fine = missing_energy(2), missing_energy(8)
    assert fine < 1e-4
    assert np.log2(coarse / fine) / 2.0 == pytest.approx(2.0, abs=0.15)


def test_force_and_power_are_means_over_the_frame() -> None:
    drive = TrajectorySinusoid(np.array([0]), 0.3, PERIOD)
    world = make_world(CART, slab=False, motions=(drive,))
    frame = frame_of(world, 0.01, 5)
    row = Columns(world.setup).values(fb.Snapshot(world, 1, frame))
    forces = [step.actuator[0] for step in frame.steps]
    assert row["force_rail_N"] == pytest.approx(np.mean(forces))
    assert np.ptp(forces) > 0.1 * abs(row["force_rail_N"])
    assert row["target_rail_m"] == pytest.approx(drive.position(0.05)[0])
    assert row["target_rail_m"] == pytest.approx(row["position_rail_m"])
    assert "target_elbow_rad" not in row
    assert "torque_elbow_Nm" not in row


@dataclass
class HeldBall:
    """A ball joint that keeps its pose."""

    dofs = np.array([0, 1, 2])

    def position(self, time: float) -> np.ndarray:
        return np.array([1.0, 0.0, 0.0, 0.0])

    def velocity(self, time: float) -> np.ndarray:
        return np.zeros(3)


def test_a_ball_joint_has_three_torques() -> None:
    """3 kg, held 1 m to the side."""
    world = make_world(BALL, slab=False, gravity=(0.0, 0.0, -9.81), motions=(HeldBall(),))
    columns = Columns(world.setup)
    row = columns.values(fb.Snapshot(world, 1, frame_of(world, 0.01, 2)))
    assert list(row) == list(columns.names)
    assert_allclose([row[f"torque_shoulder_{a}_Nm"] for a in "xyz"], [0.0, -29.43, 0.0], atol=1e-9)
    assert row["power_shoulder_W"] == 0.0


def test_two_joints_with_the_same_column_are_refused() -> None:
    """The torque of a ball joint about x, and that of a hinge with '_x' behind its name."""
    arm = (
        '<body name="arm"><joint name="shoulder_x"/><geom type="sphere" size="0.1"/></body></body>'
    )
    world = make_world(BALL.replace("</body>", arm, 1), slab=False)
    with pytest.raises(fb.SceneError, match="two columns 'torque_shoulder_x_Nm'"):
        Columns(world.setup, joints=("shoulder", "shoulder_x"))


def test_joints_are_chosen_as_the_scene_says() -> None:
    eel = build(fb.load_scene("eel", {"domain.resolution": "61"})).world
    every = Columns(eel.setup)
    assert [c for c in every.names if c.startswith("power_")] == [
        f"power_joint_{n}_W" for n in range(1, 6)
    ]
    none = Columns(eel.setup, joints=False)
    assert not [c for c in none.names if c.startswith(("target_", "torque_", "power_"))]
    named = Columns(eel.setup, joints=("joint_2", "head_x"))
    assert set(named.names) - set(none.names) == {
        "target_joint_2_rad",
        "torque_joint_2_Nm",
        "power_joint_2_W",
        "force_head_x_N",
        "power_head_x_W",
    }
    row = every.values(fb.Snapshot(replace(eel, time=0.75), 0, None))
    wave = np.radians(20.0) * (3 * 0.75**2 - 2 * 0.75**3)
    assert row["target_joint_3_rad"] == pytest.approx(wave * np.sin(2 * np.pi * (0.375 - 0.42)))
    assert np.isnan(row["torque_joint_3_Nm"])


def test_controlled_joints_have_their_target_in_any_case() -> None:
    for joints in ("true", "false", '["hinge"]'):
        scene = fb.load_scene("block-drag-max", {"output.joints": joints})
        with fb.Simulation(scene, workers=1) as simulation:
            columns = simulation.columns.names
        hinge = scene.controlled_joints()[0]
        assert f"target_{hinge}_rad" in columns
        assert (f"torque_{hinge}_Nm" in columns) == (joints != "false")


@pytest.mark.parametrize(
    ("joints", "problem"),
    [
        ('["tail"]', r"\[output\] joints: joint 'tail' is not in model eel.xml. Its joints are"),
        ('"joint_1"', r"\[output\] joints is 'joint_1'. Give true, false, or a list of names"),
        ("[1]", r"\[output\] joints is \[1\]. Give true, false, or a list of names"),
    ],
)
def test_what_is_no_choice_of_joints_is_refused(joints: str, problem: str) -> None:
    with pytest.raises(fb.SceneError, match=problem):
        fb.load_scene("eel", {"output.joints": joints})


def test_joints_without_bodies_are_refused(tmp_path: Path) -> None:
    scene = tmp_path / "empty.toml"
    scene.write_text(
        "[domain]\nlower = [0.0, 0.0, 0.0]\nupper = [1.0, 1.0, 1.0]\nresolution = 16\n"
        '[output]\njoints = ["knee"]\n'
    )
    with pytest.raises(fb.SceneError, match=r"\[output\] joints: there are no bodies"):
        fb.load_scene(scene)
