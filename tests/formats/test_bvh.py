"""Any creature as BVH: joints turned about the file's axes are where the run has them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

import flowborne as fb
from flowborne.formats.creature import Creature
from flowborne.motion.bvh_file import load_bvh

from ..read_bvh import read_bvh

read_back = pytest.importorskip("read_back", exc_type=ImportError)

CRANE = """
<mujoco>
  <worldbody>
    <body name="post" pos="0.2 0.1 0.5" euler="0 0 20">
      <joint name="slew" axis="0 0 1"/>
      <geom name="post" type="box" size="0.1 0.1 0.5"/>
      <body name="sled arm" pos="0.3 0 0.4">
        <joint name="out" type="slide" axis="1 0 0"/>
        <geom name="sled" type="box" size="0.2 0.05 0.05" pos="0.2 0 0"/>
        <body name="hook" pos="0.4 0 0">
          <joint name="swing" type="ball" pos="0 0 0.1" damping="0.1"/>
          <geom name="hook" type="sphere" size="0.05" pos="0 0 -0.2"/>
        </body>
      </body>
    </body>
    <body name="ball" pos="0 1 2">
      <freejoint name="loose"/>
      <geom name="ball" type="sphere" size="0.1"/>
    </body>
  </worldbody>
</mujoco>
"""

SCENE = """
name = "crane"
gravity = [0.0, 0.0, -9.81]
[time]
frames_per_second = 25.0
frames = 5
[solids]
model = "crane.xml"
density = 1000.0
[initial]
positions = { swing = [0.9, 0.1, 0.42, 0.0] }
[[motion]]
kind = "sinusoid"
joint = "slew"
amplitude = 40.0
period = 0.5
[[motion]]
kind = "sinusoid"
joint = "out"
amplitude = 0.2
period = 0.4
"""


@pytest.fixture(scope="module")
def crane(runs: Path) -> Path:
    """A turning post with a sled on it and a hook that swings, and a ball that falls."""
    (runs / "crane.xml").write_text(CRANE)
    (runs / "crane.toml").write_text(SCENE)
    fb.run(runs / "crane.toml", runs / "crane", film=False)
    return runs / "crane"


@pytest.mark.parametrize("name", ["chain", "fish", "crane"])
def test_joints_are_where_the_run_has_them(
    name: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    folder = request.getfixturevalue(name)
    fb.export(folder, tmp_path / "out.bvh")
    bvh, skeleton = load_bvh(tmp_path / "out.bvh"), Creature(fb.open_run(folder)).skeleton
    assert [joint.name for joint in bvh.joints] == [n.replace(" ", "_") for n in skeleton.names]
    assert [joint.parent for joint in bvh.joints] == skeleton.parents.tolist()
    assert len(bvh.values) == len(fb.open_run(folder))
    assert bvh.frame_time == pytest.approx(1.0 / fb.open_run(folder).frames_per_second)
    read = read_back.Bvh(tmp_path / "out.bvh")
    joints = np.array([list(read.joints(frame).values()) for frame in range(len(bvh.values))])
    places, turns = joints[..., :3, 3], joints[..., :3, :3]
    assert_allclose(places, skeleton.position, atol=1e-5 * Creature(fb.open_run(folder)).size)
    rest = skeleton.rest[1]
    away = Rotation.from_matrix(
        np.einsum("fnij,njk,fnlk->fnil", turns, rest, skeleton.rotation).reshape(-1, 3, 3)
    )
    assert np.degrees(away.magnitude()).max() < 1e-3


def test_only_what_slides_has_places_of_its_own(crane: Path, tmp_path: Path) -> None:
    fb.export(crane, tmp_path / "out.bvh")
    joints = {joint.name: joint for joint in load_bvh(tmp_path / "out.bvh").joints}
    six = {name for name, joint in joints.items() if len(joint.channels) == 6}
    assert six == {"world", "sled_arm", "ball"}


def test_a_body_around_its_joint_is_a_bone_that_reaches_its_surface(
    crane: Path, tmp_path: Path
) -> None:
    fb.export(crane, tmp_path / "out.bvh")
    ends = {joint.name: joint.end for joint in load_bvh(tmp_path / "out.bvh").joints}
    assert ends["ball"] is not None
    assert np.linalg.norm(ends["ball"]) == pytest.approx(10.0, rel=1e-6)  # cm


def test_a_walk_is_its_clip(walk: Path, tmp_path: Path) -> None:
    fb.export(walk, tmp_path / "out.bvh")
    assert "left_knee" in read_bvh(tmp_path / "out.bvh", 0.01).names
