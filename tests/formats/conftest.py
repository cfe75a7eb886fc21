"""Three tiny runs that the exporters are tried on. Not to be written into."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

import flowborne as fb

FISH_MODEL = """
<mujoco>
  <worldbody>
    <geom name="buoy" type="sphere" size="0.1" pos="0.9 0.6 0.5" rgba="0.9 0.2 0.1 1"/>
    <body name="head">
      <freejoint name="swim"/>
      <geom name="skull" type="box" size="0.25 0.1 0.1" pos="0.25 0 0" rgba="0.2 0.4 0.6 1"/>
      <body name="tail" pos="0 0 0">
        <joint name="bend" axis="0 0 1" pos="0.05 0 0" limited="false"/>
        <geom name="spine" type="capsule" size="0.08 0.2" pos="-0.35 0 0" euler="0 90 0"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""

FISH = """
name = "fish"
dimensions = 3
gravity = [0.0, 0.0, 0.0]

[time]
frames_per_second = 24.0
frames = 4

[domain]
lower = [-1.2, -1.0, -1.0]
upper = [1.2, 1.0, 1.0]
resolution = 12

[fluid]
density = 1000.0

[boundaries]
z_max = "open"

[[sources]]
lower = [-0.8, -0.8, -1.0]
upper = [0.8, 0.8, -0.8]
volume_rate = 1.0
dye = { smoke = 1.0 }

[solids]
model = "fish.xml"
density = 1000.0

[[flesh]]
name = "skin"
bones = ["head", "tail"]
thickness = 0.12
size = 0.25
mesh = "fish.vtu"
young = 1e5
poisson = 0.4
density = 1000.0
damping = 0.02

[[motion]]
kind = "sinusoid"
joint = "bend"
amplitude = 30.0
period = 0.5
"""

WALK = """
name = "walk"
gravity = [0.0, 0.0, -9.81]
[time]
frames_per_second = 30.0
frames = 6
[human]
[clip]
"""


@pytest.fixture(scope="session")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of scene files and runs."""
    return tmp_path_factory.mktemp("runs")


@pytest.fixture(scope="session")
def chain(runs: Path) -> Path:
    """A chain of two links in a slab with dye, controlled; no flesh."""
    scene = fb.load_scene("ns-chain-2", {"domain.resolution": "24"})
    fb.run(scene, runs / "chain", frames=4, film=False)
    return runs / "chain"


@pytest.fixture(scope="session")
def fish(runs: Path) -> Path:
    """Two bones in flesh that swim in a room with dye, and a buoy that stays."""
    (runs / "fish.xml").write_text(FISH_MODEL)
    (runs / "fish.toml").write_text(FISH)
    shutil.copy(Path(__file__).with_name("fish.vtu"), runs)
    fb.run(runs / "fish.toml", runs / "fish", film=False)
    return runs / "fish"


@pytest.fixture(scope="session")
def walk(runs: Path) -> Path:
    """A human of 23 bodies that follows a clip, without fluid."""
    (runs / "walk.toml").write_text(WALK)
    fb.run(runs / "walk.toml", runs / "walk", film=False)
    return runs / "walk"
