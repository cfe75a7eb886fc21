"""Fixtures that several folders share."""

import pytest
from hypothesis import settings

from flowborne.kernels.jit import cores

settings.register_profile("same every time", derandomize=True, deadline=None)
settings.load_profile("same every time")

MODEL = """
<mujoco>
  <worldbody>
    <body name="block">
      <joint name="hinge" type="hinge" axis="0 0 1" limited="false"/>
      <geom name="block" type="box" size="0.5 0.1 1" pos="0.5 0 0"/>
    </body>
  </worldbody>
</mujoco>
"""

SCENE = """
name = "small"
dimensions = 2

[time]
frames_per_second = 24.0
frames = 12
steps_per_frame = 2

[solids]
model = "block.xml"
density = 100.0

[initial]
positions = { hinge = 60.0 }

[[wind]]
kind = "faces"
velocity = [5.0, 0.0]
density = 1.2

[[control]]
joints = ["hinge"]
strength = 60.0
probe = 5.0

[[objectives]]
kind = "wind-drag"
goal = "least"
direction = [1.0, 0.0]
bodies = ["block"]

[output]
checkpoint_every = 5
"""


def pytest_xdist_auto_num_workers() -> int:
    """Test processes side by side: one a core, but no more than memory has room for."""
    return min(cores(), 4)


@pytest.fixture
def small_scene(tmp_path):
    """Path of a wind-only scene with one hinge, which runs in milliseconds."""
    folder = tmp_path / "scene"
    folder.mkdir()
    (folder / "block.xml").write_text(MODEL)
    path = folder / "small.toml"
    path.write_text(SCENE)
    return path
