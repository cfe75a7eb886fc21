"""The motion of a run as BVH: what was controlled is replaced, the rest stays as it came."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from flowborne.base.errors import SceneError
from flowborne.motion.bvh import TO_WORLD, write_clip
from flowborne.motion.human.gait import gait_clip
from flowborne.motion.human.skeleton import standard_skeleton
from flowborne.motion.quaternions import angle, inverse, product
from flowborne.scenes.bodies import load_model
from flowborne.scenes.capture import capture_of
from flowborne.scenes.load import load_scene
from flowborne.scenes.motion_out import export_bvh
from flowborne.sim.running import run

from ..read_bvh import read_bvh
from .plain_bvh import plain
from .rigs import Way, rig

CLIPS = Path(__file__).parent / "clips"

SCENE = """
gravity = [0.0, 0.0, -9.81]
[time]
frames_per_second = 30.0
frames = 12
[human]
[clip]
"""

CONTROL = """
[initial]
positions = { lower_back = [0.98, 0.0, 0.2, 0.0] }
[[control]]
joints = ["lower_back", "left_elbow"]
strength = 90.0
[[objectives]]
kind = "effort"
"""

Finished = Callable[..., Path]


@pytest.fixture
def finished(tmp_path: Path) -> Finished:
    """Runs a walk by a file in inches with skipped frames, or by the generated gait."""

    def finished(clip: str = "", append: str = "") -> Path:
        gait = gait_clip(standard_skeleton())
        write_clip(tmp_path / "walk.bvh", gait, 0.0254)
        (tmp_path / "scene.toml").write_text(SCENE + clip + append)
        run(load_scene(tmp_path / "scene.toml"), out=tmp_path / "run", film=False)
        return tmp_path / "run"

    return finished


FILE = 'file = "walk.bvh"\nunit = 0.0254\nskip = 2\nstart = 0.1\n'


def turned_away(first: np.ndarray, second: np.ndarray) -> float:
    """Largest angle between two rotations (frames, 4), degrees."""
    return float(np.degrees(np.abs(angle(product(inverse(first), second))).max()))


def test_an_untouched_clip_comes_back(finished: Finished, tmp_path: Path) -> None:
    export_bvh(finished(FILE), tmp_path / "out.bvh")
    source, out = (read_bvh(tmp_path / f, 0.0254) for f in ("walk.bvh", "out.bvh"))
    assert out.names == source.names
    assert out.frames == 49, "0.4 s at the clip's own rate"
    part = slice(14, 14 + out.frames)
    assert np.abs(out.translation - source.translation[part]).max() < 1e-6
    for n in range(len(out.names)):
        assert turned_away(out.rotations[:, n], source.rotations[part, n]) < 1e-4


def test_controlled_joints_have_their_own_motion(finished: Finished, tmp_path: Path) -> None:
    folder = finished(FILE, CONTROL)
    export_bvh(folder, tmp_path / "out.bvh")
    source, out = (read_bvh(tmp_path / f, 0.0254) for f in ("walk.bvh", "out.bvh"))
    part = slice(14, 14 + out.frames)
    away = {
        name: turned_away(out.rotations[:, n], source.rotations[part, n])
        for n, name in enumerate(out.names)
    }
    assert {name for name, degrees in away.items() if degrees > 1e-4} == {
        "lower_back",
        "left_elbow",
    }
    back = out.rotations[:, out.names.index("lower_back")]
    for frame in (0, 5, 12):
        with np.load(folder / "states" / f"{frame:06d}.npz") as state:
            world, pelvis = state["body_rotation"][11], state["body_rotation"][1]
        # the pose of the run, 30 frames a second, is found in the clip's 120
        relative = pelvis.T @ world
        w, x, y, z = back[4 * frame]
        own = np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
        assert own == pytest.approx(relative[:, 2], abs=1e-5)


def test_a_generated_walk_is_written_anew(finished: Finished, tmp_path: Path) -> None:
    export_bvh(finished(), tmp_path / "out.bvh")
    out, gait = read_bvh(tmp_path / "out.bvh", 0.01), gait_clip(standard_skeleton())
    assert out.frames == 13
    assert out.frame_time == pytest.approx(1 / 30)
    knee = gait.names.index("right_knee")
    assert turned_away(out.rotations[::3, knee], gait.rotations[:60:12, knee]) < 1e-2
    assert out.translation[-1] == pytest.approx(gait.translation[48], abs=1e-4)


def test_a_run_without_a_clip_is_refused(tmp_path: Path) -> None:
    """The exporter of .bvh files takes the bodies' own skeleton then."""
    run(load_scene("block-effort-wind"), out=tmp_path / "run", film=False, frames=2)
    with pytest.raises(SceneError, match=r"follows no clip, so there is no skeleton to export"):
        export_bvh(tmp_path / "run", tmp_path / "out.bvh")


NECK = """
[initial]
positions = { upper_neck = [0.9, 0.0, 0.4, 0.0] }
[[control]]
joints = ["upper_neck", "lower_back"]
strength = 5.0
[[objectives]]
kind = "effort"
"""


def test_a_joint_that_the_file_lacks_turns_what_hangs_on_it(tmp_path: Path) -> None:
    """A controlled neck of two joints in a file with one, whose zeros are no person: the head turns
    as the run's does, the back as well, and a sentence says what is not in the file."""
    shutil.copy(CLIPS / "rokoko-jesse.bvh", tmp_path / "walk.bvh")
    (tmp_path / "scene.toml").write_text(SCENE + 'file = "walk.bvh"\n' + NECK)
    run(load_scene(tmp_path / "scene.toml"), out=tmp_path / "run", film=False, frames=3)
    note = export_bvh(tmp_path / "run", tmp_path / "out.bvh")
    assert note == (
        "walk.bvh has no joint for upper_neck: its motion turns Head there and moves nothing; "
        ".usd and .glb have it"
    )
    source, out = (plain((tmp_path / f).read_text()) for f in ("walk.bvh", "out.bvh"))
    frames = len(out.places["Hips"])
    capture = capture_of(load_scene(tmp_path / "scene.toml"))
    assert capture is not None
    world = TO_WORLD[capture.up]
    model = load_model(load_scene(tmp_path / "scene.toml"))
    for joint, bone in (("lower_back", "Spine"), ("head", "Head"), ("left_knee", "LeftLeg")):
        body = int(model.mj.jnt_bodyid[model.joint(joint)])
        since = []
        for frame in (0, 3):
            with np.load(tmp_path / "run" / "states" / f"{frame:06d}.npz") as state:
                moment = round(float(state["time"]) / source.frame_time)
                turned = state["body_rotation"][body]
            theirs = world @ out.rotations[bone][min(moment, frames - 1)] @ world.T
            since.append(turned.T @ theirs)
        assert since[0] == pytest.approx(since[1], abs=2e-3), joint
    away = source.rotations["Head"][0].T @ out.rotations["Head"][0]
    assert np.degrees(np.arccos((np.trace(away) - 1.0) / 2.0)) > 20.0


@pytest.mark.parametrize("reference", [False, True])
def test_a_root_that_floats_is_written_where_it_went(tmp_path: Path, reference: bool) -> None:
    """Of a person who falls, in a file with z up whose hips move in a root of their own or do not;
    heading and offset of the scene are not in the file."""
    way = Way(up="z", unit=0.01, turned=True, whole=False, reference=reference, seed=3)
    arm = "*Shoulder *Arm *ForeArm *Hand"
    text = rig("Hips Spine", "Neck Head", "*UpLeg *Leg *Foot", arm, ("Left", "Right"), way)
    (tmp_path / "walk.bvh").write_text(text)
    clip = 'file = "walk.bvh"\nfree = ["root"]\nheading = 30.0\noffset = [1.0, 2.0, 0.5]\n'
    scene = SCENE.replace("frames = 12", "frames = 3").replace("30.0", "40.0")
    (tmp_path / "scene.toml").write_text(scene + clip + 'floor = "file"\n')
    run(load_scene(tmp_path / "scene.toml"), out=tmp_path / "run", film=False)
    export_bvh(tmp_path / "run", tmp_path / "out.bvh")
    source, out = (plain((tmp_path / f).read_text()) for f in ("walk.bvh", "out.bvh"))
    assert out.places["Hips"][0] == pytest.approx(source.places["Hips"][0], abs=1e-3)
    world, back = TO_WORLD["z"], Rotation.from_euler("z", -30.0, degrees=True).as_matrix()
    moved, turned = [], []
    for frame in range(4):
        with np.load(tmp_path / "run" / "states" / f"{frame:06d}.npz") as state:
            moved.append(back @ state["q"][:3])
            turned.append(back @ state["body_rotation"][1])
        theirs = world @ (out.places["Hips"][frame] - out.places["Hips"][0])
        assert 0.01 * theirs == pytest.approx(moved[-1] - moved[0], abs=1e-6)
        own = world @ out.rotations["Hips"][frame] @ world.T
        first = world @ out.rotations["Hips"][0] @ world.T
        assert own @ first.T == pytest.approx(turned[-1] @ turned[0].T, abs=1e-6)
    assert moved[-1][2] - moved[0][2] < -0.01, "it falls"
