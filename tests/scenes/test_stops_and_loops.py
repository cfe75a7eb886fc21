"""Stops of joints in a fluid, loops closed by equalities, and joints that are held."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flowborne import Simulation
from flowborne.base.errors import SceneError
from flowborne.scenes.build import build
from flowborne.scenes.load import check_scene, load_scene
from flowborne.scenes.notes import notes_of
from flowborne.scenes.warn import warnings_of

WING = """
<mujoco>
  <default><geom contype="0" conaffinity="0"/></default>
  <worldbody>
    <body name="spar">
      <joint name="stroke" type="slide" axis="1 0 0"/>
      <geom type="cylinder" size="0.003 0.5" density="1000"/>
      <body name="wing">
        <joint name="rotate" axis="0 0 1" range="-45 45"/>
        <geom type="box" size="0.002 0.0125 0.5" pos="0 -0.0125 0" density="20"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""

BEAT = """
dimensions = 2

[time]
frames_per_second = 680.0
frames = 60
steps_per_frame = 6

[domain]
lower = [-0.12, -0.08]
upper = [0.12, 0.04]
resolution = 96

[fluid]
density = 1.2
viscosity = 1.8e-5

[solids]
model = "model.xml"

[[motion]]
kind = "formula"
joint = "stroke"
position = "0.05 * ramp(t, 0.01) * sin(2*pi*34*t)"
"""

FOUR_BAR = """
<mujoco>
  <default><geom contype="0" conaffinity="0" density="1000"/></default>
  <worldbody>
    <body name="crank">
      <joint name="crank" axis="0 0 1"/>
      <geom type="capsule" fromto="0 0 0 0 0.1 0" size="0.02"/>
      <body name="coupler" pos="0 0.1 0">
        <joint name="coupler" axis="0 0 1"/>
        <geom type="capsule" fromto="0 0 0 0.3 0.1 0" size="0.02"/>
      </body>
    </body>
    <body name="rocker" pos="0.3 0 0">
      <joint name="rocker" axis="0 0 1"/>
      <geom type="capsule" fromto="0 0 0 0 0.2 0" size="0.02"/>
    </body>
  </worldbody>
  <equality><connect name="pin" body1="coupler" body2="rocker" anchor="0.3 0.1 0"/></equality>
</mujoco>
"""

LINKAGE = """
dimensions = 2

[time]
frames_per_second = 60.0
frames = 20
steps_per_frame = 3

[domain]
lower = [-0.4, -0.4]
upper = [0.8, 0.6]
resolution = 36

[fluid]
density = 1000.0
viscosity = 1e-3

[solids]
model = "model.xml"
hold = true

[[motion]]
kind = "formula"
joint = "crank"
position = "40 * ramp(t, 0.2) * sin(2*pi*1*t)"
"""

FLOAT = """
<mujoco>
  <worldbody>
    <body name="hull" pos="0.5 0.5 0">
      {joint}
      <geom type="cylinder" size="0.1 0.5" density="1500"/>
    </body>
  </worldbody>
</mujoco>
"""

STREAM = """
dimensions = 2
gravity = [0.0, -9.81]

[time]
frames_per_second = 100.0
frames = 6

[domain]
size = [1.0, 1.0]
resolution = 24

[fluid]
density = 1000.0
velocity = [0.5, 0.0]

[boundaries]
x_min = {{ kind = "far", velocity = [0.5, 0.0] }}
x_max = {{ kind = "far", velocity = [0.5, 0.0] }}
y_min = {{ kind = "far", velocity = [0.5, 0.0] }}
y_max = {{ kind = "far", velocity = [0.5, 0.0] }}

[solids]
model = "model.xml"
hold = {hold}

[output]
bodies = ["hull"]
"""

SLIDE, FREE = '<joint name="x" type="slide" axis="1 0 0"/>', '<freejoint name="free"/>'

Written = Callable[[str, str], Path]


@pytest.fixture
def written(tmp_path: Path) -> Written:
    """Writes a scene and its model; returns the scene's path."""

    def write(scene: str, model: str) -> Path:
        (tmp_path / "model.xml").write_text(model)
        path = tmp_path / "scene.toml"
        path.write_text(scene)
        return path

    return write


def test_a_wing_turns_between_its_stops(written: Written) -> None:
    """It passed a stop at 45 degrees by 187, because MuJoCo's takes 20 ms of a beat of 29 ms."""
    angles = []
    with Simulation(load_scene(written(BEAT, WING)), workers=1) as simulation:
        for _ in range(18):
            simulation.advance_frame()
            angles.append(np.degrees(simulation.world.solid.q[1]))
    assert -45.5 < min(angles) < -44.5
    assert 44.5 < max(angles) < 45.5


@pytest.mark.parametrize("solref", ["0.021 1", "0.0105 2", "-2000 -80"])
def test_a_soft_stop_of_the_model_is_compared_with_the_fastest_drive(
    written: Written, solref: str
) -> None:
    """It is kept, and a stop that the warning proposes ends the warning."""
    limit = 'range="-45 45"'
    model = WING.replace(limit, f'{limit} solreflimit="{solref}"')
    path = written(BEAT.replace("ramp(t, 0.01) * ", ""), model)
    scene = load_scene(path)
    (said,) = [w for w in warnings_of(scene, build(scene).world.setup) if "stop" in w]
    found = re.search(r"stroke moves with a period of ([\d.]+) ms; solreflimit = \"(.*)\" in", said)
    assert found is not None
    assert float(found[1]) == pytest.approx(1e3 / 34.0, rel=0.03)
    for better in (WING.replace(limit, f'{limit} solreflimit="{found[2]}"'), WING):
        path.with_name("model.xml").write_text(better)
        scene = load_scene(path)
        assert not [w for w in warnings_of(scene, build(scene).world.setup) if "stop" in w]


def test_a_motion_beyond_a_stop_is_said(written: Written) -> None:
    limit = 'type="slide" axis="1 0 0"'
    path = written(BEAT, WING.replace(limit, f'{limit} range="-0.03 0.06"'))
    scene = load_scene(path)
    (said,) = [w for w in warnings_of(scene, build(scene).world.setup) if "range" in w]
    assert "joint 'stroke' moves to -0.05 m, 0.02 m beyond its range, and its stop" in said
    path.with_name("model.xml").write_text(WING.replace(limit, f'{limit} range="-0.05 0.05"'))
    scene = load_scene(path)
    assert not [w for w in warnings_of(scene, build(scene).world.setup) if "range" in w]


def test_joints_of_a_loop_are_not_undriven_and_cannot_be_held(written: Written) -> None:
    """A coupler that is held in the driven linkage was 199 mm off its pin, and all was "done"."""
    path = written(LINKAGE, FOUR_BAR)
    scene = load_scene(path)
    (said,) = [w for w in warnings_of(scene, build(scene).world.setup) if "[solids]" in w]
    assert "hold = true holds no joint" in said
    assert said.endswith("or in a loop; drop it")
    path.write_text(LINKAGE.replace("hold = true\n", ""))
    scene = load_scene(path)
    assert not [w for w in warnings_of(scene, build(scene).world.setup) if "[solids]" in w]
    for joint in ("coupler", "rocker"):
        path.write_text(LINKAGE.replace("hold = true", f'hold = ["{joint}"]'))
        (problem,) = check_scene(path)
        assert f"joint '{joint}' is in the loop that the equality 'pin' closes" in problem


def test_a_joint_that_follows_another_is_not_undriven(written: Written) -> None:
    follower = (
        '<equality><joint name="gear" joint1="coupler" joint2="crank" polycoef="0 2 0 0 0"/>'
        "</equality></mujoco>"
    )
    model = FOUR_BAR[: FOUR_BAR.index("  <equality>")] + follower
    path = written(LINKAGE.replace("hold = true\n", ""), model)
    scene = load_scene(path)
    assert not [w for w in warnings_of(scene, build(scene).world.setup) if "[solids]" in w]
    path.write_text(LINKAGE.replace("hold = true", 'hold = ["coupler"]'))
    (problem,) = check_scene(path)
    assert "joint 'coupler' is tied to 'crank' by the equality 'gear'" in problem


@pytest.mark.parametrize(("joint", "name"), [(SLIDE, "x"), (FREE, "free")])
def test_what_hold_true_holds_is_said(written: Written, joint: str, name: str) -> None:
    """It held no joint on the world, and `check` found nothing wrong."""
    path = written(STREAM.format(hold="true"), FLOAT.format(joint=joint))
    scene = load_scene(path)
    (said,) = [w for w in warnings_of(scene, build(scene).world.setup) if "[solids]" in w]
    assert said.endswith(f'; hold = ["{name}"] holds {name}')
    fin = '<body name="fin"><joint name="fin" axis="0 0 1"/><geom size="0.05" mass="1"/></body>'
    path.with_name("model.xml").write_text(
        FLOAT.format(joint=joint).replace("</body>", f"{fin}</body>")
    )
    scene = load_scene(path)
    model = build(scene).world.setup.solid
    assert f"[solids]: hold = true holds fin, and not {name} on the world" in [
        *notes_of(scene, model)
    ]


@pytest.mark.parametrize("name", ["root", "free"])
def test_a_floating_body_is_held_for_a_tethered_test(written: Written, name: str) -> None:
    """It stays where it starts. The drag on it is that on the same body without a joint, and what
    holds it carries that drag, its weight and its buoyancy."""
    rows = {}
    for joint in (FREE, ""):
        hold = f'["{name}"]' if joint else "false"
        path = written(STREAM.format(hold=hold), FLOAT.format(joint=joint))
        with Simulation(load_scene(path), workers=1) as simulation:
            for _ in range(6):
                simulation.advance_frame()
            rows[joint] = simulation.measure()
            if joint:
                q, v = simulation.world.solid.q, simulation.world.solid.v
                np.testing.assert_allclose(q, [0.5, 0.5, 0.0, 1.0, 0.0, 0.0, 0.0], atol=1e-15)
                np.testing.assert_array_equal(v, np.zeros(6))
                columns = [c for c in simulation.columns.names if c.startswith(("force_", "torq"))]
                assert columns == ["force_free_x_N", "force_free_y_N", "torque_free_z_Nm"]
    held, fixed = rows[FREE], rows[""]
    fluid = np.array([held[f"hull_force_{axis}_N"] for axis in "xy"])
    np.testing.assert_allclose(
        fluid, [fixed[f"hull_force_{axis}_N"] for axis in "xy"], rtol=1e-6, atol=1e-6
    )
    weight = 1500.0 * np.pi * 0.1**2 * 9.81
    drive = [held["force_free_x_N"], held["force_free_y_N"]]
    np.testing.assert_allclose(drive, -fluid + [0.0, weight], rtol=1e-9, atol=1e-9)


def test_what_contradicts_a_held_free_joint_is_refused(written: Written) -> None:
    path = written(STREAM.format(hold='["root"]'), FLOAT.format(joint=FREE))
    text = path.read_text()
    path.write_text(f'{text}[initial]\nimpulse = "none"\n')
    (problem,) = check_scene(path)
    assert "'none' is for creatures that float, and [solids] holds 'free'." in problem
    path.write_text(f"{text}[initial.velocities]\nfree = [1.0, 0, 0, 0, 0, 0]\n")
    (problem,) = check_scene(path)
    assert "[solids] holds joint 'free', which has no velocity then" in problem
    path.with_name("model.xml").write_text(FLOAT.format(joint=SLIDE))
    path.write_text(text)
    (problem,) = check_scene(path)
    assert "there is no free joint to hold as 'root'" in problem


@pytest.mark.parametrize("hold", ["root", "free"])
def test_an_actuator_on_a_held_root_is_refused(written: Written, hold: str) -> None:
    """Held, it would not move, and the actuator's force would go nowhere."""
    motor = '<actuator><motor name="pull" joint="free" gear="1 0 0 0 0 0"/></actuator></mujoco>'
    model = FLOAT.format(joint=FREE).replace("</mujoco>", motor)
    table = '[[actuator]]\nname = "pull"\nvalue = 1.0\n'
    path = written(STREAM.format(hold="false") + table, model)
    assert check_scene(path) == []
    path = written(STREAM.format(hold=f'["{hold}"]') + table, model)
    (problem,) = check_scene(path)
    assert problem == (
        f"scene {path.name}, [[actuator]] 1: 'pull' drives joint 'free', which is in [solids] hold "
        "as well. Keep one of the two."
    )
    with pytest.raises(SceneError, match="'pull' drives joint 'free'"):
        load_scene(path)
