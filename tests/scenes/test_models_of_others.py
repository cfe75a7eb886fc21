"""What `check` says of models that are built as those of others are, and what a scene takes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh

from flowborne.coupling.world import World
from flowborne.scenes.build import build
from flowborne.scenes.creature import creature_of
from flowborne.scenes.load import check_scene, load_scene
from flowborne.scenes.notes import notes_of
from flowborne.scenes.warn import warnings_of
from flowborne.solids.trajectories import ServoPD, TrajectoryServo

MODEL = """<mujoco>
<option timestep="0.004" cone="elliptic" density="1000"><flag gravity="disable"/></option>
<default><geom density="1000"/><default class="bone">
<geom contype="0" conaffinity="0" group="5"/></default></default>
<worldbody>
<geom name="floor" type="plane" size="1 1 1" pos="0 0 -1"/>
<body name="trunk"><freejoint name="root"/><geom type="capsule" size=".12 .3"/>
 <body name="arm" pos=".45 0 0"><joint name="elbow" range="20 90"/>
  <geom type="box" size=".15 .1 .1" group="3"/><geom class="bone" size=".05"/>
  <body name="hand" pos=".3 0 0"><joint name="wrist" type="ball"/><geom class="bone" size=".1"/>
  </body></body></body>
</worldbody>
<actuator><position joint="elbow" kp="8" forcerange="-3 2"/><motor joint="elbow"/></actuator>
<sensor><gyro site="here"/></sensor>
<keyframe><key name="bent" qpos="0 0 .1 1 0 0 0 1.2 0 1 0 0" qvel="0 0 0 0 0 0 .5 0 0 0"/>
</keyframe>
</mujoco>""".replace('<body name="arm"', '<site name="here"/><body name="arm"', 1)

SCENE = """
gravity = [0.0, 0.0, -9.81]
[time]
frames_per_second = 25.0
frames = 1
[domain]
lower = [-1.0, -1.0, -1.0]
upper = [1.0, 1.0, 1.0]
resolution = 32
[fluid]
density = 1000.0
[initial.positions]
[solids]
model = "robot.xml"
"""

Written = Callable[..., Path]


@pytest.fixture
def written(tmp_path: Path) -> Written:
    """The scene with more keys of [solids] and tables, and other texts in the model."""

    def written(more: str = "", **new: str) -> Path:
        model = MODEL
        for old, text in new.items():
            model = model.replace(old.replace("_", " "), text)
        (tmp_path / "robot.xml").write_text(model)
        (tmp_path / "robot.toml").write_text(SCENE + more)
        return tmp_path / "robot.toml"

    return written


def world_of(path: Path) -> World:
    return build(load_scene(path)).world


def test_what_the_creature_is_to_the_fluid(written: Written) -> None:
    """The displaced mass is what the grid has of it, here on cells of 3 cm."""
    scene = load_scene(written(), {"domain.resolution": "64"})
    creature = creature_of(scene, build(scene).world.setup)
    assert creature is not None
    trunk, arm = np.pi * 0.12**2 * (0.6 + 4 / 3 * 0.12), 0.3 * 0.2 * 0.2
    assert creature.displaced_mass == pytest.approx(1000 * (trunk + arm), rel=2e-3)
    assert 0.7 < creature.size[0] < 0.8
    assert (creature.displacing_geoms, creature.geoms) == (2, 4)
    assert creature.unmet == ("hand",)
    first, second, third = creature.lines()
    assert first.startswith("creature: 51.1 kg, displaces 46.4 kg of fluid, ")
    assert second.startswith("geoms that displace fluid: 2 of 4, of each body the visual ones")
    assert third == "moving bodies without one: hand"


def test_a_body_that_the_fluid_does_not_meet_is_warned_of(written: Written) -> None:
    path = written()
    scene = load_scene(path)
    found = warnings_of(scene, build(scene).world.setup)
    assert any(
        w.startswith("[solids]: no geom of hand displaces fluid, which flows through it; ")
        for w in found
    )
    scene = load_scene(written('displace = { groups = [0], names = ["geom[234]"] }\n'))
    setup = build(scene).world.setup
    assert not any("displaces fluid" in w for w in warnings_of(scene, setup))
    creature = creature_of(scene, setup)
    assert creature is not None
    assert creature.lines()[1] == "geoms that displace fluid: all 4"


def test_most_of_the_mass_in_what_the_fluid_does_not_meet(written: Written) -> None:
    heavy = {'<geom_class="bone"_size=".1"/>': '<geom class="bone" size=".1" mass="900"/>'}
    scene = load_scene(written(**heavy))
    found = warnings_of(scene, build(scene).world.setup)
    assert any("times the mass of the fluid in its place" in w for w in found)


def test_a_floor_inside_the_fluid(written: Written) -> None:
    for height, inside in (("-1", False), ("-.8", True)):
        scene = load_scene(written(**{'pos="0_0_-1"': f'pos="0 0 {height}"'}))
        found = [w for w in warnings_of(scene, build(scene).world.setup) if "floor" in w]
        assert bool(found) is inside, found
    assert found[0].startswith("[domain]: the plane 'floor' lies inside the fluid")


def test_decoration_outside_the_domain_is_warned_of_and_left_out(written: Written) -> None:
    far = {'<geom_name="floor"': '<geom name="target" size=".1" pos="5 0 0"/><geom name="floor"'}
    scene = load_scene(written(**far))
    found = [w for w in warnings_of(scene, build(scene).world.setup) if "target" in w]
    assert found[0].startswith("[domain]: target lies outside the domain, and no fluid meets it; ")
    scene = load_scene(written('displace = { without = ["target"] }\n', **far))
    assert not any("target" in w for w in warnings_of(scene, build(scene).world.setup))


def test_what_of_the_file_has_no_effect_is_said_once(written: Written) -> None:
    scene = load_scene(written("density = 500.0\n"))
    said = next(notes_of(scene, build(scene).world.setup.solid))
    assert said == (
        "[solids]: of robot.xml these have no effect: its timestep of 4 ms, where a step is 10 ms; "
        "options cone elliptic, density, gravity disabled; keyframes bent, of which [initial] "
        "keyframe takes one; actuators actuator0, actuator1, which nothing tells: [[actuator]], "
        "[policy] or a script tells them, and [solids] hold = true takes actuator0"
    )
    own = {'<geom_class="bone"_size=".1"/>': '<inertial mass="1" pos="0 0 0" diaginertia="1 1 1"/>'}
    scene = load_scene(written("density = 500.0\n", **own))
    said = next(notes_of(scene, build(scene).world.setup.solid))
    assert said.endswith(
        "; [solids] density for hand, whose <inertial> in the file says what they weigh"
    )


def test_what_overrules_a_density_of_the_scene_is_said(written: Written) -> None:
    bone = '<geom_class="bone"_size=".1"/>'
    for given, said in (
        ('mass="900"', "[solids] density for geoms of hand that have a mass in the file"),
        ('density="900"', "the density of geoms of hand, which [solids] density replaces"),
    ):
        geom = {bone: f'<geom class="bone" size=".1" {given}/>'}
        scene = load_scene(written("density = 500.0\n", **geom))
        assert said in next(notes_of(scene, build(scene).world.setup.solid))
        scene = load_scene(written(**geom))
        assert "[solids] density" not in next(notes_of(scene, build(scene).world.setup.solid))


def test_what_the_file_itself_switches_off_is_said(written: Written) -> None:
    flags = {'gravity="disable"': 'gravity="disable" contact="disable" limit="disable"'}
    scene = load_scene(written(**flags))
    said = list(notes_of(scene, build(scene).world.setup.solid))
    assert "[solids]: robot.xml itself switches off its contact, limit by <flag>" in said
    scene = load_scene(written())
    assert not any("<flag>" in note for note in notes_of(scene, build(scene).world.setup.solid))


def test_what_a_keyframe_has_besides_positions_is_said(written: Written) -> None:
    key = {'<key_name="bent"': '<key name="bent" ctrl="0.3 0"'}
    for given, named, told in ((key, "", False), ({}, "bent", False), (key, "bent", True)):
        path = written(**given)
        if named:
            text = path.read_text().replace("[initial.positions]", '[initial]\nkeyframe = "bent"')
            path.write_text(text)
        scene = load_scene(path)
        notes = " ".join(notes_of(scene, build(scene).world.setup.solid))
        assert ("controls of keyframe 'bent'" in notes) == told


def test_switches_of_actuators_and_sensors_have_no_effect_and_it_is_said(written: Written) -> None:
    """Environments and scripts tell actuators that the file switches off."""
    flags = {'gravity="disable"': 'actuation="disable" clampctrl="disable" sensor="disable"'}
    scene = load_scene(written(**flags, **{'density="1000">': 'actuatorgroupdisable="2">'}))
    said = next(notes_of(scene, build(scene).world.setup.solid))
    assert "actuatorgroupdisable, actuation disabled, clampctrl disabled, sensor disabled" in said


def test_a_frame_has_steps_that_keep_contact_with_the_floor_stiff(written: Written) -> None:
    """Half of the time constant of 20 ms in frames of 40 ms."""
    assert load_scene(written()).time.steps_per_frame == 4
    soft = {'type="plane"': 'type="plane" solref="0.05 1"'}
    assert load_scene(written(**soft)).time.steps_per_frame == 4
    stiff = {'type="plane"': 'type="plane" solref="0.005 1"'}
    assert load_scene(written(**stiff)).time.steps_per_frame == 16
    given = {'type="plane"': 'type="plane" solref="-1000 -10"'}
    assert load_scene(written(**given)).time.steps_per_frame == 10
    apart = {'type="plane"': 'type="plane" contype="0" conaffinity="0"'}
    assert load_scene(written(**apart)).time.steps_per_frame == 1
    path = written()
    assert load_scene(path, {"time.steps_per_frame": "2"}).time.steps_per_frame == 2


def test_a_place_outside_its_range_is_moved_into_it(written: Written) -> None:
    scene = load_scene(written())
    world = build(scene).world
    assert world.solid.q[7] == pytest.approx(np.radians(20.0))
    notes = list(notes_of(scene, world.setup.solid))
    assert (
        "[initial]: joints that the model has outside their ranges start within: "
        "elbow (0 to 20 degrees)"
    ) in notes
    path = written()
    (problem,) = check_scene(path, {"initial.positions.elbow": "10.0"})
    assert "joint 'elbow' starts at 10 degrees, outside its range from 20 to 90" in problem


def test_a_keyframe_is_where_a_run_starts(written: Written) -> None:
    named = '[initial]\nkeyframe = "bent"\n'
    path = written()
    path.write_text(path.read_text().replace("[initial.positions]\n", named))
    state = world_of(path).solid
    np.testing.assert_allclose(state.q, [0, 0, 0.1, 1, 0, 0, 0, 1.2, 0, 1, 0, 0])
    np.testing.assert_allclose(state.v, [0, 0, 0, 0, 0, 0, 0.5, 0, 0, 0])
    path.write_text(path.read_text().replace('"bent"', '"bend"'))
    (problem,) = check_scene(path)
    assert problem.endswith("keyframe: the model has no 'bend'; did you mean 'bent'?")


def test_a_keyframe_knows_floating_bodies_by_the_names_of_joints(written: Written) -> None:
    plain = {'<freejoint_name="root"/>': "", "0_0_.1_1_0_0_0_1.2": "1.2", "0_0_0_0_0_0_.5": ".5"}
    path = written('floating = ["trunk"]\n[initial]\nkeyframe = "bent"\n', **plain)
    path.write_text(path.read_text().replace("[initial.positions]\n", ""))
    np.testing.assert_allclose(world_of(path).solid.q, [0, 0, 0, 1, 0, 0, 0, 1.2, 0, 1, 0, 0])


def test_held_joints_stay_by_the_actuators_of_the_model(written: Written) -> None:
    scene = load_scene(written("hold = true\n"))
    world = build(scene).world
    assert not any("nothing drives" in w for w in warnings_of(scene, world.setup))
    elbow, wrist = world.setup.motions
    np.testing.assert_array_equal(elbow.dofs, [6])
    np.testing.assert_array_equal(wrist.dofs, [7, 8, 9])
    assert isinstance(elbow, TrajectoryServo)
    assert isinstance(elbow.servo, ServoPD)
    assert elbow.servo.torque_limit == 2.0
    inertia = world.setup.solid.mj.dof_M0[6]
    assert elbow.servo.frequency == pytest.approx(np.sqrt(8.0 / inertia))
    np.testing.assert_array_equal(wrist.position(1.0), [1, 0, 0, 0])
    np.testing.assert_array_equal(wrist.velocity(1.0), np.zeros(3))


def test_an_arm_on_a_fixed_body_hangs_limp(written: Written) -> None:
    fixed = {'<freejoint_name="root"/>': "", '<key_name="bent"': '<!-- <key name="bent"'}
    fixed |= {'0_0_.5_0_0_0"/>': '0 0 .5 0 0 0"/> -->'}
    scene = load_scene(written(**fixed))
    (said,) = [w for w in warnings_of(scene, build(scene).world.setup) if "nothing drives" in w]
    assert said.startswith("[solids]: nothing drives elbow, wrist, and no stiffness holds them; ")


def test_what_cannot_be_held_is_refused(written: Written) -> None:
    (problem,) = check_scene(written('hold = ["ellbow"]\n'))
    assert "did you mean 'elbow'?" in problem
    more = 'hold = ["elbow"]\n[[motion]]\nkind = "constant"\njoint = "elbow"\nposition = 30.0\n'
    (problem,) = check_scene(written(more))
    assert "joint 'elbow' has a [[motion]]. Keep one of them." in problem


LINK = """<link name="{name}"><inertial><mass value="1"/>
  <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
  <visual><geometry><mesh filename="link.stl"/></geometry></visual></link>"""

ROBOT = f"""<robot name="robot">{{compiler}}{LINK.format(name="base")}{LINK.format(name="tail")}
  <joint name="hinge" type="revolute"><origin xyz="0 0.3 0"/><parent link="base"/>
  <child link="tail"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/>
  </joint></robot>"""


@pytest.mark.parametrize("floating", ["", 'floating = ["base"]\n'])
def test_a_urdf_of_visual_meshes_alone_names_the_cause_and_a_key_that_works(
    written: Written, tmp_path: Path, floating: str
) -> None:
    path = written()
    path.write_text(SCENE.replace("robot.xml", "robot.urdf") + floating)
    trimesh.creation.icosphere(2, 0.12).export(tmp_path / "link.stl")
    (tmp_path / "robot.urdf").write_text(ROBOT.format(compiler=""))
    (warning,) = [w for w in warnings_of(load_scene(path), world_of(path).setup) if "fluid" in w]
    assert warning.startswith(
        "[solids]: base, tail have visual shapes alone, which "
        "MuJoCo leaves out of a URDF, so that no fluid meets them; "
    )
    key = warning.split("; ")[1].split(" within")[0]
    (tmp_path / "robot.urdf").write_text(ROBOT.format(compiler=key))
    setup = world_of(path).setup
    assert not any("fluid" in w for w in warnings_of(load_scene(path), setup))
    assert setup.solid.ngeom == 2
