"""Sound inputs that the attack starts from: small scenes, each with all files that it names."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from types import MappingProxyType
from typing import NamedTuple

import trimesh

from flowborne.motion.bvh import write_clip
from flowborne.motion.human.gait import gait_clip
from flowborne.motion.human.skeleton import standard_skeleton
from flowborne.scenes.load import library
from flowborne.solids.tissue.mesh_file import mesh_bytes, read_mesh, recipe_of
from fuzz_changes import OUTSIDE

Files = dict[str, bytes]
"""Name -> content of the files in a folder; the scene is scene.toml."""


class Broken(NamedTuple):
    """A broken input.

    files     of its folder
    settings  --set of each command, without the option itself
    links     name -> where a link of this name points to; "" makes a FIFO
    """

    files: Files
    settings: tuple[str, ...] = ()
    links: Mapping[str, str] = MappingProxyType({})

    def write(self, folder: Path, outside: Path) -> None:
        """Write it into a folder; `outside` is the path that OUTSIDE stands for."""
        for name, content in self.files.items():
            place = folder / name
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(content.replace(OUTSIDE.encode(), str(outside).encode()))
        for name, target in self.links.items():
            (folder / name).unlink(missing_ok=True)
            if target:
                (folder / name).symlink_to(target.replace(OUTSIDE, str(outside)))
            else:
                os.mkfifo(folder / name)


FISH = Path(__file__).parents[1] / "tests" / "formats"

PENDULUM = """
gravity = [0.0, 0.0, -9.81]
[time]
frames_per_second = 24.0
frames = 3
steps_per_frame = 2
[solids]
model = "model.xml"
density = 500.0
[initial]
positions = { hinge = 40.0 }
velocities = { hinge = 20.0 }
[[wind]]
kind = "faces"
velocity = [4.0, 0.0, 1.0]
[[wind]]
kind = "force"
force = [0.1, 0.0, 0.0]
[[motion]]
kind = "formula"
joint = "rail"
position = "0.1 * sin(t)"
[[control]]
joints = ["hinge"]
strength = 30.0
probe = 2.0
[[objectives]]
kind = "effort"
[output]
bodies = ["arm"]
checkpoint_every = 2
"""

ARM = """<mujoco>
  <compiler angle="degree"/>
  <worldbody>
    <geom name="floor" type="plane" size="3 3 0.1" pos="0 0 -2"/>
    <body name="cart">
      <joint name="rail" type="slide" axis="1 0 0" damping="0.1"/>
      <geom type="sphere" size="0.1"/>
      <body name="arm" pos="0 0 -0.2">
        <joint name="hinge" axis="0 1 0" range="-90 90" stiffness="0.5" armature="0.01"/>
        <geom name="arm" type="capsule" size="0.05 0.2" pos="0 0 -0.2" rgba="0.8 0.4 0.1 1"/>
        <body name="hand" pos="0 0 -0.5">
          <joint name="wrist" type="ball" frictionloss="0.01"/>
          <geom type="box" size="0.1 0.05 0.05" density="300"/>
        </body>
      </body>
    </body>
  </worldbody>
  <contact><exclude body1="cart" body2="arm"/></contact>
</mujoco>
"""

SLAB = """
dimensions = 2
gravity = [0.0, -9.81]
[time]
frames_per_second = 24.0
frames = 3
[domain]
lower = [-1.5, -2.0]
upper = [2.5, 2.0]
resolution = 16
[fluid]
density = 1000.0
viscosity = 1.0
velocity = [1.0, 0.0]
[boundaries]
x_min = { kind = "inflow", velocity = [1.0, 0.0] }
x_max = "open"
y_min = "no-slip"
y_max = "closed"
[[dye]]
kind = "bands"
side = "x_min"
count = 4
width = 0.2
[[sources]]
lower = [-1.2, 1.0]
upper = [-0.8, 1.5]
velocity = [0.5, 0.0]
dye = { smoke = 1.0 }
[solids]
model = "model.xml"
density = 1500.0
[initial]
positions = { hinge = 46.0 }
[[control]]
joints = ["hinge"]
strength = 20.0
[[objectives]]
kind = "pressure-drag"
goal = "most"
direction = [1.0, 0.0]
bodies = ["block"]
phases = { kind = "intervals", intervals = [[0.0, 0.1]], period = 0.2 }
[[objectives]]
kind = "effort"
weight = 0.1
[controller]
velocities = "removed"
settle_steps = 2
rule = { kind = "resilient", least = 0.125 }
[film]
field = "dye"
"""

SWIM = """
dimensions = 2
[constants]
period = 0.5
[time]
frames_per_second = 24.0
frames = 3
[domain]
lower = [-1.5, -2.0]
upper = [2.5, 2.0]
resolution = 16
[fluid]
density = 1000.0
[boundaries]
x_min = "no-slip"
x_max = "open"
[solids]
model = "model.xml"
density = 800.0
[[mouths]]
body = "block"
position = [0.0, 0.3, 0.0]
direction = [0.0, 1.0, 0.0]
radius = 0.2
volume_rate = 0.1
factor = "-sin(2*pi*min(t % period, 0.25))"
dye = { ink = 1.0 }
[[control]]
joints = ["hinge"]
strength = 60.0
torque_limit = 1000.0
in_phases = [{ strength = 75.0, phases = { kind = "intervals", intervals = [[0.0, 0.1]] } }]
[[objectives]]
kind = "pressure-lift"
goal = "most"
direction = [0.0, 1.0, 0.0]
bodies = ["block"]
phases = { kind = "intervals", intervals = [[0.0, 0.25]], period = 0.5 }
[[objectives]]
kind = "effort"
weight = 0.1
[controller]
knots = 2
gradient = "one-sided"
rule = { kind = "fixed" }
every = 2
servo = { kind = "pd", frequency = 4.0 }
[output]
bodies = ["block"]
exports = ["table.csv"]
[film]
field = "speed"
size = [128, 128]
frames_per_second = 24.0
start = 0.0
stop = 0.1
camera = { azimuth = 30.0, lens = 40.0, distance = 10.0 }
"""

WALK = """
gravity = [0.0, 0.0, -9.81]
[time]
frames_per_second = 24.0
frames = 3
[human]
mass = 70.0
[clip]
file = "walk.bvh"
unit = 0.01
blend = 0.05
smooth = 8.0
[initial]
positions = { lower_back = [0.985, 0.0, 0.174, 0.0] }
[[control]]
joints = ["lower_back"]
strength = 40.0
[[objectives]]
kind = "effort"
joints = ["lower_back"]
"""

KEYFRAMES = """
[time]
frames = 3
[solids]
model = "model.xml"
density = 500.0
[[motion]]
kind = "keyframes"
joint = "hinge"
file = "keys.csv"
"""

KEYS = "time,hinge,rail\n0.0,0.0,0.0\n0.1,10.0,0.1\n0.2,25.0,0.2\n0.5,30.0,0.1\n"

MESHED = """
[time]
frames = 3
[domain]
lower = [-1.0, -1.0, -1.0]
upper = [1.0, 1.0, 1.0]
resolution = 8
[fluid]
density = 1000.0
[solids]
model = "model.xml"
density = 800.0
"""

MESH_MODEL = """<mujoco>
  <asset><mesh name="hull" file="hull.{ending}" scale="1 1 1"/></asset>
  <worldbody>
    <body name="hull"><freejoint/><geom type="mesh" mesh="hull"/></body>
  </worldbody>
</mujoco>
"""

SKINNED = """
[time]
frames = 3
[solids]
model = "model.xml"
density = 800.0
[[flesh]]
name = "skin"
bones = ["cart"]
surface = "skin.ply"
size = 0.3
young = 1e5
poisson = 0.4
density = 1000.0
"""


@cache
def bases() -> dict[str, Files]:
    """Name of each base -> its files."""
    block = (library() / "block.xml").read_bytes()
    found = {
        "pendulum": {"scene.toml": PENDULUM.encode(), "model.xml": ARM.encode()},
        "slab": {"scene.toml": SLAB.encode(), "model.xml": block},
        "swim": {"scene.toml": SWIM.encode(), "model.xml": block},
        "walk": {"scene.toml": WALK.encode(), "walk.bvh": _walk()},
        "keyframes": {
            "scene.toml": KEYFRAMES.encode(),
            "model.xml": ARM.encode(),
            "keys.csv": KEYS.encode(),
        },
        "skinned": {
            "scene.toml": SKINNED.encode(),
            "model.xml": ARM.encode(),
            "skin.ply": _mesh("ply"),
        },
        "fish": {
            "scene.toml": (FISH / "fish.toml").read_bytes(),
            "fish.xml": (FISH / "fish.xml").read_bytes(),
            "fish.vtu": (FISH / "fish.vtu").read_bytes(),
        },
    }
    mesh = mesh_bytes(read_mesh(FISH / "fish.vtu"), recipe_of(FISH / "fish.vtu"))
    found["fish-npz"] = {
        "scene.toml": found["fish"]["scene.toml"].replace(b"fish.vtu", b"fish.npz"),
        "fish.xml": found["fish"]["fish.xml"],
        "fish.npz": mesh,
    }
    for ending in ("obj", "stl"):
        found[f"hull-{ending}"] = {
            "scene.toml": MESHED.encode(),
            "model.xml": MESH_MODEL.format(ending=ending).encode(),
            f"hull.{ending}": _mesh(ending),
        }
    return found


def _walk() -> bytes:
    """A walk of 1 s in centimetres."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "walk.bvh"
        write_clip(path, gait_clip(standard_skeleton()), 0.01)
        return path.read_bytes()


def _mesh(ending: str) -> bytes:
    """A closed surface of 80 triangles around the origin."""
    file = io.BytesIO()
    content = trimesh.creation.icosphere(1, 0.3).export(file_type=ending)
    file.write(content.encode() if isinstance(content, str) else content)
    return file.getvalue()
