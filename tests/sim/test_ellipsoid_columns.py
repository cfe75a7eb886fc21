"""The columns of MuJoCo's ellipsoid fluid model in a run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import flowborne as fb
from flowborne.base.errors import SceneError

RADIUS, DENSITY, STREAM, SPEED = 0.2, 1.5, 2.0, -0.5

SCENE = f"""
[time]
frames = 2
frames_per_second = 100.0

[domain]
lower = [-1.0, -1.0, -1.0]
upper = [1.0, 1.0, 1.0]
resolution = 12

[fluid]
density = {DENSITY}

[boundaries]
x_min = {{ kind = "inflow", velocity = [{STREAM}, 0.0, 0.0] }}
x_max = "open"

[solids]
model = "ball.xml"

[[motion]]
kind = "formula"
joint = "rail"
position = "{SPEED} * t"

[output]
ellipsoid_model = true
"""

BALL = f"""<mujoco><worldbody><body><joint name="rail" type="slide" axis="1 0 0"/>
<geom size="{RADIUS}"/></body></worldbody></mujoco>"""

COLUMNS = ["ellipsoid_drag_N", "ellipsoid_power_W"]


def scene_in(folder: Path, text: str = SCENE) -> Path:
    (folder / "ball.xml").write_text(BALL)
    (folder / "ball.toml").write_text(text)
    return folder / "ball.toml"


def test_a_ball_that_moves_against_a_stream_has_the_documented_drag(tmp_path: Path) -> None:
    """Of a sphere without viscosity: rho C_blunt pi r^2 |U| U with C_blunt = 0.5."""
    with fb.Simulation(scene_in(tmp_path), workers=1) as simulation:
        assert np.isnan([simulation.measure()[column] for column in COLUMNS]).all()
        for _ in range(2):
            simulation.advance_frame()
        row = simulation.measure()
    relative = STREAM - SPEED
    drag = DENSITY * 0.5 * np.pi * RADIUS**2 * relative**2
    assert [row[column] for column in COLUMNS] == pytest.approx([drag, -drag * SPEED], rel=1e-9)


def test_columns_are_there_on_request_only(tmp_path: Path) -> None:
    path = scene_in(tmp_path, SCENE.partition("[output]")[0])
    with fb.Simulation(path, workers=1) as simulation:
        assert not set(COLUMNS) & set(simulation.columns.names)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("eel", "the scene has 2 dimensions"),
        ("swimmer", r"the scene has \[\[flesh\]\]"),
        ("human-wind-back", "the scene has no fluid that acts on bodies"),
    ],
)
def test_scenes_that_the_model_does_not_know_are_refused(name: str, said: str) -> None:
    with pytest.raises(SceneError, match=rf"\[output\] ellipsoid_model: .*{said}\. Drop this key"):
        fb.load_scene(name, {"output.ellipsoid_model": "true"})
