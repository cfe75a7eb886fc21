"""Actuators of a model that MuJoCo computes: muscles, tendons, sites, filters."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

import flowborne as fb
from flowborne.control.commands import Control, Torque
from flowborne.runs.checkpoint import load_checkpoint, save_checkpoint
from flowborne.sim.running import run
from flowborne.sim.simulation import Simulation

ARM = """<mujoco><worldbody>
  <site name="shoulder" pos="0 .06 0"/>
  <body name="arm"><joint name="hinge" axis="0 0 1" damping="0.02"/>
    <geom type="capsule" size=".03" fromto="0 0 0 .3 0 0" density="500"/>
    <site name="upper" pos=".1 .04 0"/>
    <body name="hand" pos=".3 0 0"><joint name="elbow" axis="0 0 1" damping="0.02"/>
      <geom type="capsule" size=".03" fromto="0 0 0 .2 0 0" density="500"/>
      <site name="lower" pos=".05 .03 0"/><site name="tip" pos=".2 0 0"/></body></body>
</worldbody>
<tendon>
  <spatial name="biceps"><site site="upper"/><site site="lower"/></spatial>
  <spatial name="deltoid"><site site="shoulder"/><site site="upper"/></spatial>
</tendon>
<actuator>{actuators}</actuator>
<sensor>{sensors}</sensor></mujoco>"""
MUSCLES = """
  <muscle name="flexor" tendon="biceps" lengthrange="0.15 0.3" force="20"/>
  <muscle name="lift" tendon="deltoid" lengthrange="0.05 0.2" force="15"/>"""
SCENE = """
[time]
frames_per_second = {rate}
frames = 20
[solids]
model = "arm.xml"
[initial]
velocities = {{ hinge = [28.64788975654116], elbow = [-57.29577951308232] }}
{more}
"""


def arm(
    folder: Path, actuators: str, rate: int = 120, more: str = "", sensors: str = ""
) -> Simulation:
    """An arm of two links without gravity or fluid."""
    (folder / "arm.xml").write_text(ARM.format(actuators=actuators, sensors=sensors))
    (folder / "arm.toml").write_text(SCENE.format(rate=rate, more=more))
    return Simulation(folder / "arm.toml", workers=1)


def in_mujoco(actuators: str, controls: list[float], time: float) -> tuple[np.ndarray, np.ndarray]:
    """Positions and activations of MuJoCo's own run, with steps of 10 us."""
    mj = mujoco.MjModel.from_xml_string(ARM.format(actuators=actuators, sensors=""))
    mj.opt.timestep, mj.opt.gravity[:] = 1e-5, 0.0
    mj.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    data = mujoco.MjData(mj)
    data.qvel[:] = 0.5, -1.0
    for _ in range(round(time / mj.opt.timestep)):
        data.ctrl[:] = controls
        mujoco.mj_step(mj, data)
    return data.qpos.copy(), data.act.copy()


@pytest.mark.parametrize(
    ("actuators", "controls"),
    [
        (MUSCLES, [0.8, 0.3]),
        ('<position name="flexor" tendon="biceps" kp="200" kv="4"/>', [0.12]),
        ('<general name="flexor" joint="elbow" dyntype="filterexact" dynprm="0.05"/>', [0.2]),
        ('<motor name="flexor" site="tip" gear="0 1 0 0 0 0.1"/>', [0.5]),
        ('<intvelocity name="flexor" joint="elbow" kp="3" actrange="-2 2"/>', [1.5]),
        ('<damper name="flexor" joint="elbow" kv="1" ctrlrange="0 1"/>', [1.0]),
    ],
    ids=["muscle", "tendon servo", "filter", "site", "integrator", "damper"],
)
def test_actuators_move_a_body_as_in_mujoco(
    tmp_path: Path, actuators: str, controls: list[float]
) -> None:
    """The error against fine steps of MuJoCo falls with the step to a third of a per cent."""
    wanted, act = in_mujoco(actuators, controls, 0.25)
    errors = []
    for rate in (120, 240, 480):
        tables = [
            f'[[actuator]]\nname = "{name}"\nvalue = {u}'
            for name, u in zip(("flexor", "lift"), controls, strict=False)
        ]
        with arm(tmp_path, actuators, rate, "\n".join(tables)) as simulation:
            for _ in range(rate // 4):
                simulation.advance_frame()
            errors.append(np.abs(simulation.world.solid.q - wanted).max())
            found = simulation.world.solid.act
    least = 3e-3 * np.abs(wanted).max()  # activations advance in steps of 1 ms
    assert errors[2] < 1.2 * least, errors
    assert errors[1] < max(0.4 * errors[0], least), errors
    assert errors[2] < max(0.4 * errors[1], least), errors
    np.testing.assert_allclose(found, act, atol=2e-3)


def test_a_stiff_servo_of_a_tendon_is_stable_at_any_step(tmp_path: Path) -> None:
    """A spring whose frequency times the step is 4 moves no farther than its pull takes it."""
    stiff = '<position name="flexor" tendon="biceps" kp="4e4" kv="10"/>'
    with arm(tmp_path, stiff, 24) as simulation:
        for _ in range(100):
            simulation.advance_frame({"flexor": Control(0.249)})
            assert abs(simulation.world.solid.q).max() < 2.0


SCENE_FILTER = '<general name="flexor" joint="elbow" dyntype="filterexact" dynprm="0.05"/>'


def numbers(simulation: Simulation) -> dict[str, bytes]:
    return {name: values.tobytes() for name, values in simulation.world.arrays().items()}


def test_activations_are_state_and_go_on_to_the_same_bits(tmp_path: Path) -> None:
    """In snapshots, in copies of the world, and from a checkpoint."""
    told = {"flexor": Control(0.7), "lift": Control(0.2)}
    with arm(tmp_path, MUSCLES) as simulation:
        for _ in range(3):
            simulation.advance_frame(told)
        kept = simulation.snapshot()
        copy = kept.world.copy()
        copy.solid.act[:] = 9.0
        save_checkpoint(tmp_path / "kept.npz", kept.world, 3, kept.sensed)
        simulation.advance_frame(told)
        wanted = numbers(simulation)
        assert 0.3 < simulation.world.solid.act[0] < 0.7
        simulation.restore(kept)
        simulation.advance_frame(told)
        assert numbers(simulation) == wanted
        world, frame, sensed = load_checkpoint(tmp_path / "kept.npz", simulation.setup)
        simulation.restore(fb.Snapshot(world, frame, None, sensed))
        assert simulation.actuator("flexor").force == kept.sensed.output[:1]
        simulation.advance_frame(told)
        assert numbers(simulation) == wanted


def test_a_scene_drives_actuators_by_numbers_formulas_and_keyframes(tmp_path: Path) -> None:
    """A frame holds the control of its middle; forces, powers and controls are columns, and a run
    that was stopped goes on to the same numbers."""
    more = """
[constants]
most = 0.5
[output]
checkpoint_every = 2
[[actuator]]
name = "flexor"
value = "most * t"
[[actuator]]
name = "lift"
times = [0.0, 1.0]
values = [0.0, 1.0]
"""
    with arm(tmp_path, MUSCLES, more=more) as simulation:
        report = simulation.advance_frame()
        row = simulation.measure()
        middle = 0.5 * simulation.frame_time
        assert row["actuator_flexor_control"] == pytest.approx(0.5 * middle)
        assert 0.0 < row["actuator_lift_control"] < 0.1
        rate = report.step.velocity
        assert row["actuator_flexor_force"] == report.step.output[0] < 0.0
        assert row["torque_elbow_Nm"] == report.step.actuator[1]
        powers = row["actuator_flexor_power_W"], row["actuator_lift_power_W"]
        assert sum(powers) == pytest.approx(report.step.actuator @ rate, rel=1e-9)
        assert row["actuator_flexor_activation"] == simulation.world.solid.act[0]
        simulation.advance_frame({"flexor": Control(1.0)})
        assert simulation.measure()["actuator_flexor_control"] == 1.0
    whole = run(tmp_path / "arm.toml", tmp_path / "whole", frames=6, film=False)
    run(tmp_path / "arm.toml", tmp_path / "half", frames=4, film=False)
    half = run(tmp_path / "arm.toml", tmp_path / "half", resume=True, frames=6, film=False)
    rows = [fb.open_run(result.folder).history for result in (whole, half)]
    for column in rows[0]:
        if not column.startswith("seconds"):
            np.testing.assert_array_equal(rows[0][column], rows[1][column])


def test_several_actuators_of_a_joint_add(tmp_path: Path) -> None:
    """A servo that has its joint to itself drives it; with another one both are forces."""
    servo = '<position name="place" joint="elbow" kp="0.2"/>'
    both = servo + '<velocity name="slow" joint="elbow" kv="0.02"/>'
    wanted, _ = in_mujoco(both, [0.4, 0.0], 0.5)
    with arm(tmp_path, both, 480) as simulation:
        for _ in range(240):
            simulation.advance_frame({"place": Control(0.4), "slow": Control(0.0)})
        assert simulation.world.solid.q == pytest.approx(wanted, abs=2e-3)


ONE_SIDED = {
    "forcerange": '<position name="flexor" joint="elbow" kp="2" forcerange="-.1 .01"/>',
    "no pull": '<position name="flexor" joint="elbow" kp="2" forcerange="0 .05"/>',
    "negative gear": '<position name="flexor" joint="elbow" gear="-1" kp="2" forcerange="0 .1"/>',
}


@pytest.mark.parametrize("actuator", ONE_SIDED.values(), ids=[*ONE_SIDED])
@pytest.mark.parametrize("u", [0.6, -0.6])
def test_a_servo_with_more_force_to_one_side_exerts_that_of_mujoco(
    tmp_path: Path, actuator: str, u: float
) -> None:
    """A drive has one limit for both sides, so it is none."""
    wanted, _ = in_mujoco(actuator, [u], 0.25)
    with arm(tmp_path, actuator, 480) as simulation:
        for _ in range(120):
            simulation.advance_frame({"flexor": Control(u)})
        assert simulation.world.solid.q == pytest.approx(wanted, abs=3e-3)


def test_a_servo_keeps_the_torque_limit_of_its_joint(tmp_path: Path) -> None:
    """As MuJoCo's, whose actuators together exert no more than the joint's actuatorfrcrange."""
    servo = '<position name="flexor" joint="elbow" kp="20"/>'
    with arm(tmp_path, servo) as simulation:
        text = (tmp_path / "arm.xml").read_text()
        simulation.close()
    limited = text.replace('name="elbow"', 'name="elbow" actuatorfrcrange="-.1 .1"')
    (tmp_path / "arm.xml").write_text(limited)
    with Simulation(tmp_path / "arm.toml", workers=1) as simulation:
        drives = []
        for _ in range(10):
            simulation.advance_frame({"flexor": Control(1.0)})
            drives.append(simulation.joint("elbow").drive[0])
    assert max(np.abs(drives)) == pytest.approx(0.1, rel=1e-9)


def test_an_actuator_of_two_controls_is_told_both(tmp_path: Path) -> None:
    """MuJoCo's PID takes a position and a velocity."""
    pid = '<pid name="flexor" joint="elbow" kp="2" kv="0.1"/>'
    wanted, _ = in_mujoco(pid, [0.4, 0.2], 0.25)
    with arm(tmp_path, pid, 480) as simulation:
        for _ in range(120):
            simulation.advance_frame({"flexor": Control([0.4, 0.2])})
        assert simulation.world.solid.q == pytest.approx(wanted, abs=3e-3)
        assert simulation.actuator("flexor").force.shape == (1,)


@pytest.mark.parametrize("command", [fb.Position(0.1), fb.Velocity(1.0), Torque(0.1)])
@pytest.mark.parametrize("actuator", ["motor", "position"])
def test_a_joint_is_told_by_itself_or_by_its_actuator(
    tmp_path: Path, command: fb.Position, actuator: str
) -> None:
    """Two commands would move it, and one of them would be lost."""
    with arm(tmp_path, f'<{actuator} name="flexor" joint="elbow"/>') as simulation:
        with pytest.raises(fb.SceneError, match=r"'flexor' drives joint 'elbow', which has a comm"):
            simulation.advance_frame({"elbow": command, "flexor": Control(0.1)})
        simulation.advance_frame({"hinge": command, "flexor": Control(0.1)})


FALLING = """<mujoco><worldbody><body name="box"><freejoint/>
  <geom type="box" size=".1 .2 .3" density="500"/><site name="imu" pos=".05 0 0"/>
</body></worldbody>
<sensor><gyro name="gyro" site="imu"/><accelerometer name="felt" site="imu"/>
  <velocimeter name="speed" site="imu"/><framepos name="at" objtype="site" objname="imu"/>
  <framequat name="turned" objtype="body" objname="box"/></sensor></mujoco>"""


def test_a_falling_body_reads_no_acceleration_and_its_own_rotation(tmp_path: Path) -> None:
    """It turns about a principal axis by 2 rad/s, 0.05 m off the site: w^2 r towards the axis."""
    (tmp_path / "box.xml").write_text(FALLING)
    turning = f"velocities = {{ joint0 = [0, 0, 0, 0, 0, {np.degrees(2.0)}] }}"
    (tmp_path / "box.toml").write_text(
        "gravity = [0.0, 0.0, -9.81]\n[time]\nframes_per_second = 200\nframes = 40\n"
        f'[solids]\nmodel = "box.xml"\n[initial]\n{turning}\n'
    )
    with Simulation(tmp_path / "box.toml", workers=1) as simulation:
        assert np.isnan(simulation.sensor("felt")).all()
        assert simulation.sensor("at") == pytest.approx([0.05, 0.0, 0.0])
        for _ in range(40):
            simulation.advance_frame()
        row = simulation.measure()
        assert simulation.sensor("gyro") == pytest.approx([0.0, 0.0, 2.0], abs=1e-9)
        assert simulation.sensor("felt") == pytest.approx([-0.2, 0.0, 0.0], abs=1e-6)
        assert np.linalg.norm(simulation.sensor("speed")) == pytest.approx(
            np.hypot(9.81 * simulation.time, 0.1), rel=1e-9
        )
        assert row["sensor_gyro_z_rad/s"] == simulation.sensor("gyro")[2]
        assert row["sensor_turned_w"] == pytest.approx(row["box_qw"], rel=1e-14)


def test_what_carries_a_body_is_felt(tmp_path: Path) -> None:
    """A box that rests on a floor: its accelerometer reads g, and its skin the whole weight."""
    (tmp_path / "box.xml").write_text(
        FALLING.replace("<worldbody>", '<worldbody><geom type="plane" size="1 1 1"/>')
        .replace(
            '<site name="imu"', '<site name="skin" type="box" size=".12 .22 .32"/><site name="imu"'
        )
        .replace("<sensor>", '<sensor><touch name="weight" site="skin"/>')
        .replace('<body name="box">', '<body name="box" pos="0 0 .3">')
    )
    (tmp_path / "box.toml").write_text(
        'gravity = [0.0, 0.0, -9.81]\n[time]\nframes = 40\n[solids]\nmodel = "box.xml"\n'
    )
    with Simulation(tmp_path / "box.toml", workers=1) as simulation:
        for _ in range(40):
            simulation.advance_frame()
        assert simulation.sensor("felt")[2] == pytest.approx(9.81, rel=1e-3)
        assert simulation.sensor("weight")[0] == pytest.approx(9.81 * 24.0, rel=1e-3)


def test_the_force_of_the_drive_is_read_by_actuatorfrc(tmp_path: Path) -> None:
    sensors = """<actuatorfrc name="pull" actuator="flexor"/>
      <tendonpos name="long" tendon="biceps"/>
      <jointpos name="bent" joint="elbow"/><jointvel name="bends" joint="elbow"/>"""
    with arm(tmp_path, MUSCLES, sensors=sensors) as simulation:
        for _ in range(6):
            simulation.advance_frame({"flexor": Control(1.0)})
        assert simulation.sensor("pull") == simulation.actuator("flexor").force < -1.0
        joint = simulation.joint("elbow")
        assert simulation.sensor("bent") == joint.position
        assert simulation.sensor("bends") == joint.velocity
        assert 0.2 < simulation.sensor("long")[0] < 0.26


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ('name = "flexer"\nvalue = 1.0', "actuator 'flexer' is not in .*did you mean 'flexor'"),
        ('name = "flexor"', "has a value or times and values"),
        ('name = "flexor"\nvalue = "most * t"', "most"),
        ('name = "late"\nvalue = 1.0', "'late' has a delay, which is not simulated"),
    ],
)
def test_wrong_tables_are_refused(tmp_path: Path, table: str, said: str) -> None:
    late = '<motor name="late" joint="elbow" delay="0.1" nsample="4"/>'
    with pytest.raises(fb.SceneError, match=said):
        arm(tmp_path, MUSCLES + late, more=f"[[actuator]]\n{table}")


def test_an_actuator_and_a_motion_of_one_joint_are_refused(tmp_path: Path) -> None:
    more = (
        '[[actuator]]\nname = "flexor"\nvalue = 1.0\n[[motion]]\nkind = "constant"\njoint = "elbow"'
    )
    with pytest.raises(fb.SceneError, match="drives joint 'elbow', which is moved by a"):
        arm(tmp_path, SCENE_FILTER, more=more)


def test_trials_act_with_the_actuators_of_the_world(tmp_path: Path) -> None:
    """Copies advance their own activations, and the effort to hold a joint is its muscle's pull."""
    more = """
[[actuator]]
name = "lift"
value = 1.0
[[control]]
joints = ["hinge"]
strength = 60.0
[[objectives]]
kind = "effort"
"""
    efforts = []
    for value in ("0.0", "1.0"):
        with arm(tmp_path, MUSCLES, more=more.replace("1.0", value)) as simulation:
            for _ in range(4):
                report = simulation.advance_frame()
            kept = simulation.world.solid.act.copy()
            efforts.append(report.objective)
            assert simulation.controller is not None
            simulation.controller.decide(simulation.world.copy(), simulation.frame_time, fb.step)
            np.testing.assert_array_equal(simulation.world.solid.act, kept)
            assert kept[1] == pytest.approx(float(value), abs=0.1)
            assert simulation.setup.motions == ()
    assert efforts[0] == pytest.approx(0.0, abs=1e-12)
    assert efforts[1] > 1e-3


def test_a_mimic_joint_gets_its_share_of_the_torque(tmp_path: Path) -> None:
    """Two equal flaps, tied by an equality: the motor of one accelerates the inertia of both."""
    flap = (
        '<body name="{0}"><joint name="{0}" axis="0 0 1"/>'
        '<geom type="box" size=".2 .01 .1" pos=".2 0 {1}" density="400"/></body>'
    )
    model = (
        f"<mujoco><worldbody>{flap.format('one', 0)}{flap.format('two', 1)}</worldbody><equality>"
        '<joint joint1="two" joint2="one" solref="0.002 1"/></equality><actuator>'
        '<motor name="turn" joint="one"/></actuator></mujoco>'
    )
    (tmp_path / "arm.xml").write_text(model)
    (tmp_path / "arm.toml").write_text(SCENE.format(rate=240, more="").replace("hinge", "one"))
    text = (tmp_path / "arm.toml").read_text().split("[initial]")[0]
    (tmp_path / "arm.toml").write_text(text)
    with Simulation(tmp_path / "arm.toml", workers=1) as simulation:
        inertia = fb.bodies.mass_matrix(simulation.setup.solid, simulation.world.solid.q)
        for _ in range(60):
            simulation.advance_frame({"turn": Control(0.1)})
        one, two = (simulation.joint(name).velocity[0] for name in ("one", "two"))
        time = simulation.time - 0.5 * simulation.frame_time
    assert one == pytest.approx(0.1 * time / inertia.trace(), rel=0.01)
    assert two == pytest.approx(one, rel=0.01)


def test_hold_leaves_the_joints_that_actuators_drive(tmp_path: Path) -> None:
    more = '[[actuator]]\nname = "flexor"\nvalue = 0.5\n'
    text = SCENE.replace('model = "arm.xml"', 'model = "arm.xml"\nhold = true')
    (tmp_path / "arm.xml").write_text(ARM.format(actuators=MUSCLES, sensors=""))
    (tmp_path / "arm.toml").write_text(text.format(rate=120, more=more))
    with Simulation(tmp_path / "arm.toml", workers=1) as simulation:
        assert simulation.setup.motions == ()


POLICY = """
import flowborne as fb

def pull(simulation, most):
    bent = simulation.sensor("bent")[0]
    return {"flexor": fb.Control(most * (bent < 0.5)), "lift": fb.Control(0.0)}
"""


def test_a_policy_tells_actuators_by_what_sensors_read(tmp_path: Path) -> None:
    (tmp_path / "puller.py").write_text(POLICY)
    more = """
[policy]
function = "puller:pull"
actuators = ["flexor", "lift"]
parameters = { most = 0.8 }
"""
    sensors = '<jointpos name="bent" joint="elbow"/>'
    with arm(tmp_path, MUSCLES, sensors=sensors):
        text = (tmp_path / "arm.toml").read_text()
        (tmp_path / "arm.toml").write_text('plugins = ["puller.py"]\n' + text + more)
    with Simulation(tmp_path / "arm.toml", workers=1) as simulation:
        controls = []
        for _ in range(60):
            simulation.advance_frame()
            controls.append(simulation.measure()["actuator_flexor_control"])
        assert set(controls) == {0.0, 0.8}
        assert simulation.joint("elbow").position[0] > 0.4


def test_a_policy_that_tells_nothing_is_refused(tmp_path: Path) -> None:
    (tmp_path / "puller.py").write_text(POLICY)
    with pytest.raises(fb.SceneError, match="tells nothing"):
        arm(tmp_path, MUSCLES, more='[policy]\nfunction = "puller:pull"\n')


def test_a_keyframe_of_the_model_gives_activations(tmp_path: Path) -> None:
    key = '<keyframe><key name="tense" qpos="0.1 0.2" act="0.6 0.3"/></keyframe></mujoco>'
    with arm(tmp_path, MUSCLES):
        (tmp_path / "arm.xml").write_text(
            ARM.format(actuators=MUSCLES, sensors="").replace("</mujoco>", key)
        )
        text = (tmp_path / "arm.toml").read_text()
        (tmp_path / "arm.toml").write_text(
            text.replace("[initial]", '[initial]\nkeyframe = "tense"')
        )
    with Simulation(tmp_path / "arm.toml", workers=1) as simulation:
        np.testing.assert_array_equal(simulation.world.solid.act, [0.6, 0.3])


def test_a_force_sensor_reads_what_hangs_on_a_joint(tmp_path: Path) -> None:
    """A pendulum of 2 kg, on which a wind pulls by 5 N: what else its acceleration takes."""
    (tmp_path / "arm.xml").write_text(
        '<mujoco><worldbody><body name="bob"><joint name="hinge" axis="0 1 0" stiffness="1e6"/>'
        '<geom type="sphere" size=".1" pos="0 0 -.5" mass="2"/><site name="top"/></body>'
        '</worldbody><sensor><force name="pull" site="top"/></sensor></mujoco>'
    )
    (tmp_path / "arm.toml").write_text(
        'gravity = [0.0, 0.0, -9.81]\n[time]\nframes = 4\n[solids]\nmodel = "arm.xml"\n'
        '[[wind]]\nkind = "force"\nforce = [5.0, 0.0, 0.0]\n'
    )
    with Simulation(tmp_path / "arm.toml", workers=1) as simulation:
        for _ in range(4):
            simulation.advance_frame()
        wanted = 2.0 * simulation.body("bob").acceleration - [5.0, 0.0, -2.0 * 9.81]
        assert simulation.sensor("pull") == pytest.approx(wanted, abs=5e-3)


@pytest.mark.parametrize("gear", [1.0, 2.0])
def test_the_rotor_of_a_motor_turns_with_its_joint(tmp_path: Path, gear: float) -> None:
    """An armature of 0.1 kg m^2 behind a gear, also where a hinge carries the whole body."""
    (tmp_path / "arm.xml").write_text(
        '<mujoco><worldbody><body name="rotor"><joint name="hinge" axis="0 0 1"/>'
        '<geom type="sphere" size=".1" mass="2"/></body></worldbody><actuator>'
        f'<motor name="turn" joint="hinge" gear="{gear}" armature="0.1"/></actuator></mujoco>'
    )
    (tmp_path / "arm.toml").write_text('[time]\nframes = 4\n[solids]\nmodel = "arm.xml"\n')
    inertia = 0.4 * 2.0 * 0.1**2 + 0.1 * gear**2
    with Simulation(tmp_path / "arm.toml", workers=1) as simulation:
        report = simulation.advance_frame({"turn": Control(0.3)})
        assert report.step.acceleration[0] == pytest.approx(0.3 * gear / inertia, rel=1e-9)


@pytest.mark.parametrize(
    "inertia",
    ['tendon="string" armature="0.2"', 'tendon="string" gear="2" armature="0.05"'],
    ids=["gear 1", "gear 2"],
)
def test_a_tendon_has_the_inertia_of_its_motor(tmp_path: Path, inertia: str) -> None:
    """MuJoCo's mass matrix counts, also on a hinge that carries the whole body."""
    model = (
        '<mujoco><worldbody><site name="wall" pos=".3 0 0"/><body name="b"><joint name="hinge" '
        'axis="0 0 1"/><geom type="sphere" size=".1" mass="2"/><site name="rim" pos=".1 .1 0"/>'
        '</body></worldbody><tendon><spatial name="string"><site site="wall"/><site site="rim"/>'
        f'</spatial></tendon><actuator><motor name="turn" {inertia}/></actuator></mujoco>'
    )
    (tmp_path / "arm.xml").write_text(model)
    (tmp_path / "arm.toml").write_text('[time]\nframes = 4\n[solids]\nmodel = "arm.xml"\n')
    with Simulation(tmp_path / "arm.toml", workers=1) as simulation:
        whole = fb.bodies.mass_matrix(simulation.setup.solid, simulation.world.solid.q)[0, 0]
        report = simulation.advance_frame({"hinge": Torque(0.1)})
        assert whole > 1.2 * 0.4 * 2.0 * 0.1**2
        assert report.step.acceleration[0] == pytest.approx(0.1 / whole, rel=1e-6)


def test_a_servo_of_a_joint_has_the_columns_of_its_actuator(tmp_path: Path) -> None:
    """The force times the gear is the torque of the drive, within the actuator's largest force."""
    servo = '<position name="flexor" joint="elbow" kp="2" gear="2" forcerange="-.1 .1"/>'
    more = '[[actuator]]\nname = "flexor"\nvalue = 1.0\n'
    with arm(tmp_path, servo, more=more) as simulation:
        for _ in range(4):
            simulation.advance_frame()
            row = simulation.measure()
            torque = 2.0 * row["actuator_flexor_force"]
            assert row["torque_elbow_Nm"] == pytest.approx(torque, rel=1e-12)
            assert row["power_elbow_W"] == pytest.approx(row["actuator_flexor_power_W"], rel=1e-12)
            assert 0.0 < row["actuator_flexor_force"] <= 0.1 * (1.0 + 1e-9)
            assert row["actuator_flexor_control"] == 1.0
