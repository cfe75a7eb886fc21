"""Thrusters of a scene: their table, columns and commands."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import flowborne as fb
from flowborne.scenes.build import build
from flowborne.scenes.warn import warnings_of
from flowborne.sim.running import run
from flowborne.sim.simulation import Simulation

HULL = """<mujoco><worldbody><body name="hull" pos=".5 .5 0">{joint}
  <geom type="sphere" size=".1" density="1000"/>
  <site name="aft" pos="-.2 0 0"/><site name="left" pos="0 .2 0" zaxis="0 1 0"/></body>
  <body name="stone" pos=".9 .9 0"><geom type="sphere" size=".05"/></body></worldbody>
  <actuator><general name="motor" site="aft" gear="1 0 0 0 0 0"/></actuator></mujoco>"""
SCENE = """
dimensions = 2
[constants]
top = 4.0
[time]
frames_per_second = 50.0
frames = 6
[domain]
size = [1.0, 1.0]
resolution = 32
[fluid]
density = 1000.0
[boundaries]
x_min = "open"
x_max = "open"
y_min = "open"
y_max = "open"
[solids]
model = "hull.xml"
[output]
checkpoint_every = 2
"""
AFT = """
[[thruster]]
site = "aft"
radius = 0.08
range = [-5.0, 5.0]
thrust = "top * sin(10*t)"
"""
SIDE = """
[[thruster]]
name = "side"
body = "hull"
point = [0.0, -0.2, 0.0]
axis = [0.0, 2.0, 0.0]
radius = 0.08
coefficient = 0.5
speed = 1.5
times = [0.0, 0.04, 1.0]
factors = [0.0, 1.0, 1.0]
"""
POLICY = """
[policy]
function = "{name}:hold"
thrusters = ["aft"]
bodies = ["hull"]
"""
HOLD = """
import flowborne as fb

def hold(simulation):
    offset = simulation.body("hull").position - [0.5, 0.5, 0.0]
    return {"aft": fb.Control(-200.0 * offset[0] + 1.0), "gust": fb.Force("hull", (0.0, 2.0, 0.0))}
"""


def hull(folder: Path, more: str = AFT + SIDE, joint: str = "<freejoint/>") -> Path:
    (folder / "hull.xml").write_text(HULL.format(joint=joint))
    scene = folder / "hull.toml"
    scene.write_text(
        SCENE.replace(
            "[constants]\ntop = 4.0\n", "" if AFT not in more else "[constants]\ntop = 4.0\n"
        )
        + more
    )
    return scene


def test_thrusts_are_columns_and_what_the_body_is_given(tmp_path: Path) -> None:
    with Simulation(hull(tmp_path), workers=1) as simulation:
        for _ in range(5):
            simulation.advance_frame()
        row = simulation.measure()
    assert row["thrust_aft_N"] == pytest.approx(4.0 * np.sin(1.0), rel=1e-12)
    assert row["thrust_side_N"] == pytest.approx(0.5 * 1000.0 * 1.5**2 * 0.16**3, rel=1e-12)
    assert row["jet_power_aft_W"] > 0.0
    assert row["applied_force_hull_x_N"] == pytest.approx(row["thrust_aft_N"], rel=1e-3)
    assert row["applied_force_hull_y_N"] == pytest.approx(row["thrust_side_N"], rel=1e-3)
    assert row["momentum_budget_error"] < 1e-10


def test_a_script_tells_thrusters_within_their_range(tmp_path: Path) -> None:
    with Simulation(hull(tmp_path), workers=1) as simulation:
        report = simulation.advance_frame({"aft": fb.Control(-7.0)})
        row = simulation.measure()
        assert report.beyond == ("aft: -7 is beyond its limit of -5 N or 1/s",)
        assert row["thrust_aft_N"] == -5.0
        simulation.advance_frame({"side": fb.Control(1.0)})
        row = simulation.measure()
        assert row["thrust_side_N"] == pytest.approx(500.0 * 0.16**3)
        assert row["thrust_aft_N"] == pytest.approx(4.0 * np.sin(0.4))  # its own again
        with pytest.raises(fb.SceneError, match="a finite number"):
            simulation.advance_frame({"aft": fb.Control(np.nan)})


def test_a_policy_tells_thrusters_and_pushes_and_its_run_goes_on(tmp_path: Path) -> None:
    (tmp_path / "hold_place.py").write_text(HOLD)
    scene = hull(tmp_path, AFT + POLICY.format(name="hold_place"))
    scene.write_text('plugins = ["hold_place.py"]\n' + scene.read_text())
    whole = run(scene, tmp_path / "whole", workers=1, film=False)
    run(scene, tmp_path / "part", frames=3, workers=1, film=False)
    part = run(scene, tmp_path / "part", frames=6, resume=True, workers=1, film=False)
    a, b = (fb.open_run(result.folder).history for result in (whole, part))
    for name in a:
        if not name.startswith("seconds"):
            np.testing.assert_array_equal(a[name], b[name], name)
    assert a["thrust_aft_N"][0] == 1.0
    assert np.ptp(a["thrust_aft_N"]) > 0.01
    assert a["applied_force_hull_y_N"] == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize(
    ("given", "wanted", "said"),
    [
        (
            'site = "aft"',
            'site = "aff"',
            "[[thruster]] 1: site 'aff' is not in model hull.xml; did",
        ),
        ('site = "aft"', 'body = "stone"', "body 'stone' is fixed, and no force moves it"),
        ('site = "aft"', "", "[[thruster]] 1 has neither a site nor a body"),
        ('site = "aft"', 'site = "left"\naxis = [0.0, 1.0, 0.0]', "the axis leaves the plane"),
        ('site = "aft"', 'site = "aft"\nname = "motor"', "'motor' is an actuator of the model as"),
        ('site = "aft"', 'site = "aft"\nname = "side"', "2: 'side' is thruster 1 as well"),
        ('site = "aft"', 'body = "hull"', "[[thruster]] 1: thruster 'thruster_1' has no water in"),
        ('site = "aft"', 'body = "hull"\npoint = [2.0, 0.0, 0.0]', "has no water in its disc"),
        ("range = [-5.0, 5.0]", "range = [5.0, -5.0]", "has a range from 5 to -5. Swap them"),
        ("range = [-5.0, 5.0]", "range = [5.0]", "[[thruster]] 1, range"),
        ('thrust = "top', 'speed = 3.0\nthrust = "top', "has a thrust and a coefficient or speed"),
        ('thrust = "top', 'thrust = "tip', "name 'tip' is not known"),
        ("radius = 0.08\nrange", "radius = 0.0\nrange", "0.0 is not greater than 0"),
        ("density = 1000.0\n", 'coupling = "one-way"\n', "no fluid that thrusters can push"),
    ],
)
def test_wrong_thrusters_are_refused(tmp_path: Path, given: str, wanted: str, said: str) -> None:
    scene = hull(tmp_path)
    text = scene.read_text()
    assert given in text
    scene.write_text(text.replace(given, wanted, 1))
    with pytest.raises(fb.SceneError) as error:
        fb.load_scene(scene)
    assert any(said in problem for problem in error.value.problems), error.value.problems


@pytest.mark.parametrize(
    ("given", "wanted", "said"),
    [
        ("radius = 0.08", "radius = 0.02", "disc of aft is less than two cells"),
        ('"top * sin', '"900 * top * sin', "the jet of thruster 'aft' crosses up to"),
        ("[0.0, -0.2, 0.0]", "[0.0, -0.07, 0.0]", "% of the disc of 'side' are water"),
    ],
)
def test_poor_discs_are_told(tmp_path: Path, given: str, wanted: str, said: str) -> None:
    scene = hull(tmp_path)
    text = scene.read_text().replace(given, wanted, 1)
    scene.write_text(text.replace("range = [-5.0, 5.0]\n", ""))
    loaded = fb.load_scene(scene)
    assert any(said in warning for warning in warnings_of(loaded, build(loaded).world.setup))


def test_sound_discs_are_no_warning(tmp_path: Path) -> None:
    loaded = fb.load_scene(hull(tmp_path))
    assert not [w for w in warnings_of(loaded, build(loaded).world.setup) if "thruster" in w]
