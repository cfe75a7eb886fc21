"""Two joints in a row with least effort in wind and gravity: the paper's rule stalls."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flowborne import Simulation, load_scene

MODEL = """
<mujoco>
  <worldbody>
    <body name="upper">
      <joint name="shoulder" type="hinge" axis="0 0 1"/>
      <geom name="upper" type="box" size="0.05 0.5 0.5" pos="0 -0.5 0"/>
      <body name="lower" pos="0 -1 0">
        <joint name="elbow" type="hinge" axis="0 0 1"/>
        <geom name="lower" type="box" size="0.05 0.5 0.5" pos="0 -0.5 0"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""

SCENE = """
dimensions = 2
gravity = [0.0, -9.81]

[time]
frames = 72

[solids]
model = "arm.xml"
density = 200.0

[initial]
positions = { shoulder = 70.0, elbow = -100.0 }

[[wind]]
kind = "faces"
velocity = [5.0, 0.0]

[[control]]
joints = ["shoulder", "elbow"]
strength = 60.0
probe = 1.0

[[objectives]]
kind = "effort"
"""


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    (tmp_path / "arm.xml").write_text(MODEL)
    path = tmp_path / "arm.toml"
    path.write_text(SCENE)
    return path


def effort(arm: Path, rule: str) -> tuple[float, float]:
    """Mean effort of the motion itself over the third second, and the elbow's angle at its end,
    degrees."""
    found = []
    with Simulation(load_scene(arm, {"controller.rule": rule})) as simulation:
        for _ in range(72):
            simulation.advance_frame()
            found.append(simulation.measure()["measured_effort"])
        elbow = np.degrees(simulation.world.solid.q[1])
    return float(np.mean(found[48:])), float(elbow)


def test_two_joints_in_a_row_find_the_pose_that_the_steepest_way_does_not_reach(arm: Path) -> None:
    """On two equal plates gravity and wind pull alike: both hang along the net force."""
    least, elbow = effort(arm, "quasi-newton")
    assert abs(elbow) < 0.2
    fixed, golden = effort(arm, "fixed")[0], effort(arm, "golden-section")[0]
    assert least < 0.1 * golden < 0.1 * fixed
