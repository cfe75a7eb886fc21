"""Joints that are told from outside what to do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import flowborne as fb
from flowborne.control.commands import Control, Position, Torque, Velocity
from flowborne.sim.simulation import Simulation
from flowborne.solids.trajectories import JointCommand

PENDULUM = """<mujoco><worldbody>
  <body name="arm"><joint name="hinge" axis="0 0 1" range="-60 60" actuatorfrcrange="-30 40"/>
    <geom type="capsule" size=".05 .3" pos="0 .4 0" euler="90 0 0" density="500"/>
    <body name="hand" pos="0 .8 0"><joint name="wrist" axis="0 0 1"/>
      <geom type="capsule" size=".05 .1" pos="0 .2 0" euler="90 0 0" density="500"/></body></body>
</worldbody></mujoco>"""
SCENE = """
dimensions = {dimensions}
[time]
frames_per_second = {rate}
frames = 20
[solids]
model = "arm.xml"
{more}
"""
WIND = """
[[wind]]
kind = "faces"
velocity = [3.0, 0.0, 0.0]
density = 1.2
"""
CONTROL = """
[[control]]
joints = ["hinge", "wrist"]
strength = 90.0
[[objectives]]
kind = "effort"
"""


def arm(folder: Path, more: str = "", dimensions: int = 3, rate: int = 60) -> Simulation:
    """An arm of two links that nothing but the table of `more` acts on."""
    (folder / "arm.xml").write_text(PENDULUM)
    text = SCENE.format(dimensions=dimensions, rate=rate, more=more)
    (folder / "arm.toml").write_text(text)
    return Simulation(folder / "arm.toml", workers=1)


def bits(simulation: Simulation) -> dict[str, bytes]:
    return {name: values.tobytes() for name, values in simulation.world.arrays().items()}


def eel() -> Simulation:
    return Simulation(fb.load_scene("eel", {"domain.resolution": "24"}), workers=1)


def told_as_the_scene_says(simulation: Simulation) -> dict[str, Position]:
    """Targets of the scene's own motions for the coming frame."""
    end, names = simulation.time + simulation.frame_time, simulation.setup.solid.joint_names
    joints = {joint: simulation.setup.solid.dofs_of(joint)[0] for joint in names}
    found = {}
    for motion in simulation.setup.motions:
        joint = next(name for name, dof in joints.items() if dof == motion.dofs[0])
        after = motion.position(end + simulation.frame_time)
        found[joint] = Position(motion.position(end), then=after)
    return found


def test_targets_of_the_scene_give_its_bits() -> None:
    with eel() as own, eel() as told:
        for _ in range(6):
            own.advance_frame()
            told.advance_frame(told_as_the_scene_says(told))
        assert bits(told) == bits(own)
        assert told.joint("joint_3").drive == own.joint("joint_3").drive


def test_a_joint_is_where_it_was_told_to_be(tmp_path: Path) -> None:
    with arm(tmp_path) as simulation:
        report = simulation.advance_frame({"hinge": Position(0.2), "wrist": Velocity(-1.5)})
        assert simulation.joint("hinge").position[0] == 0.2
        assert simulation.joint("wrist").position[0] == pytest.approx(-1.5 / 60.0)
        assert report.beyond == ()
        simulation.advance_frame({"hinge": Position(0.2)})
        assert simulation.joint("hinge").position[0] == 0.2


def test_a_torque_turns_a_joint_by_its_inertia(tmp_path: Path) -> None:
    """Of an arm whose wrist is held still, from half a step after the start."""
    with arm(tmp_path) as simulation:
        model = simulation.setup.solid
        inertia = fb.bodies.mass_matrix(model, simulation.world.solid.q)[0, 0]
        for _ in range(10):
            simulation.advance_frame({"hinge": Torque(2.0), "wrist": Position(0.0)})
            assert simulation.joint("hinge").drive[0] == 2.0
        time, step, joint = simulation.time, simulation.frame_time, simulation.joint("hinge")
        assert joint.velocity[0] == pytest.approx(2.0 / inertia * (time - 0.5 * step))
        assert joint.position[0] == pytest.approx(1.0 / inertia * time * (time - step))


@pytest.mark.parametrize("dimensions", [2, 3])
def test_a_pd_controller_of_torques_swings_as_the_equation_says(
    tmp_path: Path, dimensions: int
) -> None:
    """Critically damped from 0.05 rad: x = 0.05 (1 + w t) exp(-w t), to first order in the frame,
    since a torque is what the controller saw when the frame began."""
    w, errors = 6.0, []
    for rate in (60, 120, 240):
        folder = tmp_path / f"{rate}"
        folder.mkdir()
        more = f"[initial]\npositions = {{ hinge = {np.degrees(0.05)} }}"
        with arm(folder, more, dimensions, rate) as simulation:
            inertia = fb.bodies.mass_matrix(simulation.setup.solid, simulation.world.solid.q)[0, 0]
            speed = 0.0
            for _ in range(rate // 2):
                angle = simulation.joint("hinge").position[0]
                torque = -inertia * (w * w * angle + 2.0 * w * speed)
                simulation.advance_frame({"hinge": Torque(torque), "wrist": Position(0.0)})
                speed = simulation.joint("hinge").velocity[0]
            t = simulation.time
            wanted = 0.05 * (1.0 + w * t) * np.exp(-w * t)
            errors.append(abs(simulation.joint("hinge").position[0] - wanted))
    assert errors[0] < 0.002
    assert errors[1] < 0.6 * errors[0]
    assert errors[2] < 0.6 * errors[1]


def test_drives_of_any_nominal_speed_that_are_saturated_move_alike(tmp_path: Path) -> None:
    """One that wants 10 to 10000 rad/s and may give 2 N m is a torque of 2 N m."""
    with arm(tmp_path) as simulation:
        kept, found = simulation.world, []
        for speed in (10.0, 100.0, 1000.0, 10000.0):
            world = kept.copy()
            command = JointCommand.none(2)
            command.set(np.array([0]), 0.0, speed, 2.0)
            command.set(np.array([1]), 0.0, 0.0)
            for _ in range(12):
                report = fb.step(world, simulation.frame_time, command)
            found.append((world.solid.q[0], report.actuator[0]))
        for _ in range(12):
            simulation.advance_frame({"hinge": Torque(2.0), "wrist": Position(0.0)})
        found.append((simulation.joint("hinge").position[0], simulation.joint("hinge").drive[0]))
    positions, torques = np.array(found).T
    assert np.abs(positions - positions[-1]).max() < 1e-9
    assert (torques == 2.0).all()


ACTUATORS = """<actuator>
  <motor name="push" joint="hinge" gear="4" ctrlrange="-1 1"/>
  <position name="place" joint="wrist" kp="3" forcerange="-5 5"/>
  <velocity name="pace" joint="wrist" kv="2" gear="2"/>
  <general name="flex" joint="wrist" dyntype="integrator"/>
</actuator></mujoco>"""


def test_actuators_of_the_model_mean_what_they_do_in_mujoco(tmp_path: Path) -> None:
    """Motors by gear and range; servos go where MuJoCo's come to rest, and as fast."""
    with arm(tmp_path):
        (tmp_path / "arm.xml").write_text(PENDULUM.replace("</mujoco>", ACTUATORS))
    with Simulation(tmp_path / "arm.toml", workers=1) as simulation:
        simulation.advance_frame({"push": Control(0.5), "wrist": Position(0.0)})
        assert simulation.joint("hinge").drive[0] == 2.0
        simulation.advance_frame({"push": Control(3.0), "wrist": Position(0.0)})
        assert simulation.joint("hinge").drive[0] == 4.0
        for _ in range(10):
            simulation.advance_frame({"hinge": Velocity(0.0), "pace": Control(0.8)})
        assert simulation.joint("wrist").velocity[0] == pytest.approx(0.4)
        for _ in range(240):
            simulation.advance_frame({"hinge": Velocity(0.0), "place": Control(0.3)})
            assert abs(simulation.joint("wrist").drive[0]) <= 5.0
        assert simulation.joint("wrist").position[0] == pytest.approx(0.3, abs=1e-3)
        with pytest.raises(fb.SceneError, match=r"no actuator 'puch'; did you mean 'push'"):
            simulation.advance_frame({"puch": Control(1.0)})


def test_limits_hold_and_are_told(tmp_path: Path) -> None:
    with arm(tmp_path) as simulation:
        report = simulation.advance_frame({"hinge": Position(2.0), "wrist": Torque(5.0)})
        assert simulation.joint("hinge").position[0] == pytest.approx(np.pi / 3)
        assert report.beyond == ("hinge: 2 is beyond its limit of 1.047 rad",)
        report = simulation.advance_frame({"hinge": Torque(-1000.0)})
        assert simulation.joint("hinge").drive[0] == -30.0
        assert report.beyond == ("hinge: -1000 is beyond its limit of -30 N m or N",)


@pytest.mark.parametrize(
    ("commands", "said"),
    [
        ({"elbow": Torque(1.0)}, "the model has no joint 'elbow'. It has: hinge, wrist"),
        ({"hinge": 1.0}, "the command to 'hinge' is 1.0: give a Position, a Vel"),
        ({"hinge": Torque(np.nan)}, "the command to 'hinge' has nan: give a finite number"),
        ({"hinge": Velocity([1.0, 2.0])}, r"the command to 'hinge' has \[1.0, 2.0\]: give a"),
    ],
)
def test_wrong_commands_are_refused_and_change_nothing(
    tmp_path: Path, commands: dict[str, object], said: str
) -> None:
    with arm(tmp_path) as simulation:
        before = bits(simulation)
        with pytest.raises(fb.SceneError, match=said):
            simulation.advance_frame(commands)  # type: ignore[arg-type]
        assert bits(simulation) == before


def test_the_controller_decides_for_the_joints_that_are_not_told(tmp_path: Path) -> None:
    """Its trials know what the others are told: the wrist is carried by an arm that turns."""
    with arm(tmp_path, WIND + CONTROL) as simulation:
        report = simulation.advance_frame({"hinge": Velocity(1.0)})
        assert report.gradient[0] == 0.0
        assert report.gradient[1] != 0.0
        turning = report.gradient[1]
        assert simulation.joint("hinge").position[0] == pytest.approx(1.0 / 60.0)
    with arm(tmp_path, WIND + CONTROL) as simulation:
        still = simulation.advance_frame({"hinge": Velocity(0.0)}).gradient[1]
    with arm(tmp_path, WIND + CONTROL) as simulation:
        pushed = simulation.advance_frame({"hinge": Torque(30.0)}).gradient[1]
    assert len({turning, still, pushed}) == 3


def test_a_snapshot_goes_on_to_the_same_bits() -> None:
    with eel() as simulation:
        commands = {"joint_2": Torque(0.01), "joint_4": Position(0.1)}
        simulation.advance_frame(commands)
        kept = simulation.snapshot()
        ends = []
        for _ in range(2):
            simulation.restore(kept)
            assert np.isfinite(simulation.joint("joint_2").velocity).all()
            for _ in range(2):
                simulation.advance_frame(commands)
            ends.append(bits(simulation))
        assert ends[0] == ends[1]


def test_acceleration_and_flow_are_sensed() -> None:
    """Mass times acceleration of the whole eel is the force of the water on it; the pressure on
    both sides of its head differs."""
    with eel() as simulation:
        for _ in range(3):
            simulation.advance_frame()
        model = simulation.setup.solid
        states = [simulation.body(name) for name in model.body_names[1:]]
        force = sum(state.force for state in states)
        mass = model.mj.body_mass[1 : len(states) + 1]
        pushed = sum(m * state.acceleration for m, state in zip(mass, states, strict=True))
        np.testing.assert_allclose(pushed[:2], force[:2], rtol=1e-3, atol=1e-6)
        head = model.body_names[1]
        flow = simulation.flow_at(head, np.array([[0.0, 0.06, 0.0], [0.0, -0.06, 0.0]]))
        assert flow.velocity[:, :2].all()
        assert abs(flow.pressure[0] - flow.pressure[1]) > 0.1
