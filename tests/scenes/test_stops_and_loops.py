"""Stops of joints in a fluid, loops closed by equalities, and joints that are held."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flowborne import Simulation
from flowborne.scenes.load import load_scene

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
