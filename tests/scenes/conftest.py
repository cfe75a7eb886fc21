"""A user's own scene, which every test may spoil in its own way."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from ..pages.blocks import blocks_of

PAGE = Path(__file__).parents[2] / "docs" / "own-clip.md"

MODEL = """
<mujoco>
  <worldbody>
    <geom name="post" type="box" size="0.1 0.1 0.5" contype="0" conaffinity="0"/>
    <body name="arm">
      <joint name="shoulder" type="hinge" axis="0 0 1" range="-120 120"/>
      <geom name="arm" type="box" size="0.05 0.2 0.5" pos="0 -0.2 0" density="1200"/>
      <body name="hand" pos="0 -0.4 0">
        <joint name="wrist" type="hinge" axis="0 0 1"/>
        <geom name="hand" type="sphere" size="0.1" pos="0 -0.1 0" density="1200"/>
      </body>
    </body>
    <body name="slider" pos="0.5 0.5 0">
      <joint name="rail" type="slide" axis="1 0 0"/>
      <geom name="slider" type="sphere" size="0.1" density="800"/>
    </body>
    <body name="float" pos="-0.5 0.5 0">
      <freejoint name="drift"/>
      <geom name="float" type="sphere" size="0.1" density="500"/>
    </body>
  </worldbody>
</mujoco>
"""

SCENE = """
dimensions = 2
gravity = [0.0, -9.81]

[time]
frames = 3

[domain]
lower = [-1.0, -1.0]
upper = [1.0, 1.0]
resolution = 16

[fluid]
density = 1000.0

[boundaries]
x_min = { kind = "inflow", velocity = [1.0, 0.0] }
x_max = "open"

[solids]
model = "squid.xml"

[[motion]]
kind = "sinusoid"
joint = "shoulder"
amplitude = 30.0
period = 2.0

[[control]]
joints = ["wrist"]
strength = 20.0

[[objectives]]
kind = "effort"
"""


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    """Writes swim.toml, with some of its text replaced or appended, beside squid.xml."""

    def write(replace: dict[str, str] | None = None, append: str = "", model: str = MODEL) -> Path:
        text = SCENE
        for old, new in (replace or {}).items():
            assert old in text, f"{old!r} is not in the scene"
            text = text.replace(old, new)
        (tmp_path / "squid.xml").write_text(model)
        path = tmp_path / "swim.toml"
        path.write_text(text + append)
        return path

    return write


@pytest.fixture
def swing(tmp_path: Path) -> str:
    """Path of the handbook's scene of a walker whose arms stay close to the clip."""
    (text,) = (block.text for block in blocks_of(PAGE) if block.file == "swing.toml")
    path = tmp_path / "swing.toml"
    path.write_text(text, encoding="utf-8")
    return str(path)
