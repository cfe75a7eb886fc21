"""Forces on single bodies, from a scene and from a script."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import flowborne as fb
from flowborne.sim.running import run
from flowborne.sim.simulation import Simulation

BALL = """<mujoco><worldbody><body name="ball" pos=".5 .5 .5"><freejoint name="free"/>
  <geom type="sphere" size=".1" mass="{mass}"/></body></worldbody></mujoco>"""
SCENE = """
[time]
frames_per_second = 50.0
frames = {frames}
[solids]
model = "ball.xml"
[output]
bodies = ["ball"]
checkpoint_every = 2
"""
WATER = """
[domain]
size = [1.0, 1.0, 1.0]
resolution = 16
[fluid]
density = 1000.0
[boundaries]
x_min = "periodic"
x_max = "periodic"
"""
FAR = 'x_max = "far"\ny_min = "far"\ny_max = "far"\nz_min = "far"\nz_max = "far"'
TOW = """
[[force]]
body = "ball"
force = [1.0, 0.0, 0.0]
"""


def ball(folder: Path, more: str = "", mass: float = 2.0, frames: int = 10) -> Path:
    (folder / "ball.xml").write_text(BALL.format(mass=mass))
    scene = folder / "ball.toml"
    scene.write_text(SCENE.format(frames=frames) + more)
    return scene


def refused(scene: Path) -> str:
    with pytest.raises(fb.SceneError) as error:
        fb.load_scene(scene)
    assert len(error.value.problems) == 1
    return str(error.value)


def test_one_newton_on_a_free_body_in_no_fluid(tmp_path: Path) -> None:
    """v = F t / m, and x = F t^2 / 2 m: leapfrog is exact for it."""
    with Simulation(ball(tmp_path, TOW), workers=1) as simulation:
        for _ in range(10):
            simulation.advance_frame()
        row, state = simulation.measure(), simulation.body("ball")
    assert state.velocity[0] == pytest.approx(1.0 * 0.2 / 2.0, rel=1e-12)
    assert row["ball_x_m"] - 0.5 == pytest.approx(1.0 * 0.2**2 / 4.0, rel=1e-12)
    assert row["applied_force_ball_x_N"] == 1.0
    assert row["momentum_applied_x_Ns"] == pytest.approx(1.0 * 0.02, rel=1e-12)
    assert row["ball_force_x_N"] == 0.0  # none of it is the fluid's


def test_a_script_and_a_scene_give_the_same_motion(tmp_path: Path) -> None:
    tow = fb.Force("ball", force=(1.0, 0.0, 0.0))
    with (
        Simulation(ball(tmp_path), workers=1) as told,
        Simulation(ball(tmp_path, TOW), workers=1) as given,
    ):
        for _ in range(10):
            report = told.advance_frame({"tow": tow})
            given.advance_frame()
        gained = told.body("ball").velocity[0] / given.body("ball").velocity[0]
    assert report.applied()[1] == pytest.approx([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert gained == pytest.approx(1.0 - 0.5 / 10)  # its first half step went without


def test_a_force_at_a_point_of_the_body_turns_with_it(tmp_path: Path) -> None:
    """I w = r F t at first; a force along the body's own x stays on it as it turns."""
    more = TOW + 'point = [0.0, 0.1, 0.0]\nframe = "body"\n'
    with Simulation(ball(tmp_path, more), workers=1) as simulation:
        for _ in range(10):
            report = simulation.advance_frame()
        state = simulation.body("ball")
    inertia = 0.4 * 2.0 * 0.1**2
    assert state.angular_velocity[2] == pytest.approx(-0.1 * 0.2 / inertia, rel=1e-9)
    force, torque = report.applied()[1, :3], report.applied()[1, 3:]
    assert force == pytest.approx(state.rotation[:, 0], abs=0.02)
    assert abs(force[1]) > 0.1
    assert torque == pytest.approx([0.0, 0.0, -0.1], abs=1e-12)


def error_of_impulse(folder: Path, rate: int) -> float:
    """Relative error of the momentum that (1 - cos w t) N gives in a period of 0.2 s."""
    more = '\n[constants]\nw = 31.41592653589793\n[[force]]\nbody = "ball"\n'
    scene = ball(folder, more + 'force = ["1 - cos(w * t)", 0.0, 0.0]\n')
    overrides = {"time.frames_per_second": f"{rate}"}
    with Simulation(fb.load_scene(scene, overrides), workers=1) as simulation:
        for _ in range(rate // 5):
            simulation.advance_frame()
        return abs(2.0 * simulation.body("ball").velocity[0] / 0.2 - 1.0)


def test_a_formula_gives_the_impulse_of_its_integral(tmp_path: Path) -> None:
    """The trapezium rule, which is exact over a period but for the half step at the start."""
    coarse, fine = error_of_impulse(tmp_path, 50), error_of_impulse(tmp_path, 100)
    assert coarse < 3e-3
    assert fine < coarse / 7.5


def test_towed_in_water_a_sphere_has_its_added_mass(tmp_path: Path) -> None:
    """(m + m_f / 2) a = F in an endless fluid."""
    water = WATER.replace("periodic", "far").replace("16", "40").replace('x_max = "far"', FAR)
    with Simulation(ball(tmp_path, water + TOW, mass=4.18879), workers=1) as simulation:
        simulation.advance_frame()
        state = simulation.body("ball")
    assert state.acceleration[0] == pytest.approx(1.0 / (1.5 * 4.18879), rel=0.03)


def test_bodies_and_fluid_have_the_impulse_of_the_force(tmp_path: Path) -> None:
    """Across periodic sides nothing else gives any; a half step at the start, then three."""
    with Simulation(ball(tmp_path, WATER + TOW, mass=4.18879), workers=1) as simulation:
        for _ in range(3):
            simulation.advance_frame()
            row = simulation.measure()
            assert row["momentum_budget_error"] < 1e-10
    gained = row["momentum_solid_x_Ns"] + row["momentum_fluid_x_Ns"]
    assert gained == pytest.approx(3.5 * 0.02, rel=1e-10)


def test_a_run_that_goes_on_has_the_same_bits(tmp_path: Path) -> None:
    more = '\n[[force]]\nbody = "ball"\nforce = ["sin(20*t)", 0.0, 0.0]\npoint = [0.0, 0.05, 0.0]\n'
    scene = ball(tmp_path, more, frames=6)
    whole = run(scene, tmp_path / "whole", workers=1, film=False).folder / "history.csv"
    run(scene, tmp_path / "part", frames=4, workers=1, film=False)
    part = (
        run(scene, tmp_path / "part", frames=6, resume=True, workers=1, film=False).folder
        / "history.csv"
    )
    a, b = fb.open_run(whole.parent).history, fb.open_run(part.parent).history
    for name in a:
        if not name.startswith(("seconds", "wall")):
            np.testing.assert_array_equal(a[name], b[name], name)


@pytest.mark.parametrize(
    ("force", "said"),
    [
        (fb.Force("bal"), "body 'bal', which is not in the model; did you mean 'ball'?"),
        (fb.Force("world"), "the force 'tow': body 'world' is fixed, and no force moves it"),
        (fb.Force("ball", (1.0, 2.0)), "force (1.0, 2.0): give 3 finite numbers"),  # type: ignore[arg-type]
        (fb.Force("ball", torque=(0.0, np.nan, 0.0)), "torque (0.0, nan, 0.0)"),
        (fb.Force("ball", point="hand"), "point 'hand'"),  # type: ignore[arg-type]
        (fb.Force("ball", frame="site"), "frame 'site': give 'world' or 'body'"),  # type: ignore[arg-type]
    ],
)
def test_what_a_script_gives_is_looked_at(tmp_path: Path, force: fb.Force, said: str) -> None:
    with Simulation(ball(tmp_path), workers=1) as simulation:
        with pytest.raises(fb.SceneError) as error:
            simulation.advance_frame({"tow": force})
        assert simulation.frame == 0
    assert said in str(error.value)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ('[[force]]\nbody = "bal"\n', "[[force]] 1: body 'bal' is not in model ball.xml; did you"),
        ('[[force]]\nbody = "world"\n', "Take one that can move"),
        (
            '[[force]]\nbody = "ball"\nforce = ["sin(q)", 0.0]\n',
            "[[force]] 1, force, entry 1: formula",
        ),
        ('[[force]]\nbody = "ball"\nforce = ["1/t", 0.0]\n', "is not finite at t = 0 s"),
        ('[[force]]\nbody = "ball"\nforce = [1.0]\n', "Give x, y and z"),
        ('[[force]]\nbody = "ball"\nframe = "site"\n', "'site' is not known"),
    ],
)
def test_what_a_scene_gives_is_looked_at(tmp_path: Path, more: str, said: str) -> None:
    assert said in refused(ball(tmp_path, more))


def test_in_a_plane_nothing_pushes_out_of_it(tmp_path: Path) -> None:
    scene = ball(tmp_path, '[[force]]\nbody = "ball"\nforce = [0.0, 0.0, "t"]\n')
    scene.write_text("dimensions = 2\n" + scene.read_text())
    assert "has a force z of t, which a scene of 2 dimensions does not have" in refused(scene)
