"""A scene's clip: its human, who follows it, and what is said of a clip that cannot be used."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flowborne.io.bvh import read_bvh, write_clip
from flowborne.scenes.build import Built, build
from flowborne.scenes.capture import capture_of, followers
from flowborne.scenes.human.gait import gait_clip
from flowborne.scenes.human.standard import standard_skeleton
from flowborne.scenes.load import check_scene, load_scene
from flowborne.scenes.notes import notes_of
from flowborne.scenes.save import HUMAN_FILE, save_scene, scene_files
from flowborne.simulation import Simulation

Write = Callable[..., Path]

SCENE = """
gravity = [0.0, 0.0, -9.81]
[time]
frames = 4
[human]
[clip]
file = "walk.bvh"
unit = 0.01
"""

CONTROL = """
[[control]]
joints = ["lower_back", "left_elbow"]
strength = 40.0
[[objectives]]
kind = "effort"
"""


@pytest.fixture(scope="module")
def walk() -> str:
    """A walk of 1.05 s as a BVH file in centimetres."""
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "walk.bvh"
        write_clip(path, gait_clip(standard_skeleton()), 0.01)
        return path.read_text()


@pytest.fixture
def write(tmp_path: Path, walk: str) -> Write:
    """Writes stroll.toml and walk.bvh, with some of the text of either replaced."""

    def write(
        append: str = "", scene: dict[str, str] | None = None, clip: dict[str, str] | None = None
    ) -> Path:
        texts = {"stroll.toml": SCENE + append, "walk.bvh": walk}
        for name, replaced in (("stroll.toml", scene), ("walk.bvh", clip)):
            for old, new in (replaced or {}).items():
                assert old in texts[name], f"{old!r} is not in {name}"
                texts[name] = texts[name].replace(old, new, 1)
        for name, text in texts.items():
            (tmp_path / name).write_text(text)
        return tmp_path / "stroll.toml"

    return write


def built(path: Path) -> Built:
    return build(load_scene(path))


def test_the_human_has_the_bones_of_the_clip_and_follows_it(write: Write) -> None:
    path = write()
    scene = load_scene(path)
    world = build(scene).world
    model, clip = world.setup.solid, read_bvh(path.with_name("walk.bvh"), 0.01)
    assert model.nbody == 24
    assert model.body_mass.sum() == pytest.approx(73.0)
    capture = capture_of(scene)
    assert capture is not None
    assert followers(scene, capture, model) == model.joint_names
    with Simulation(scene) as simulation:
        for frame in range(1, 4):
            simulation.advance_frame()
            q, moment = simulation.world.solid.q, 5 * frame
            assert simulation.time == pytest.approx(moment * clip.frame_time, abs=1e-3)
            (motion,) = simulation.world.setup.motions
            assert np.abs(q - motion.position(simulation.time)).max() < 1e-8, "no lag"
            assert q[:3] == pytest.approx(clip.translation[moment], abs=2e-3)


def test_a_clip_can_be_placed(write: Write) -> None:
    """Turned to the left about where it begins, then moved; and the way goes along."""
    placed = {"unit = 0.01": "unit = 0.01\nheading = 90.0\noffset = [3.0, -1.0, 0.5]"}
    there, here = (build(load_scene(write(scene=s))).world for s in (placed, None))
    assert there.solid.q[:3] == pytest.approx(np.add(here.solid.q[:3], (3.0, -1.0, 0.5)))
    ahead, left = here.solid.v[:2], there.solid.v[:2]
    assert ahead[0] > 0.5
    assert left == pytest.approx((-ahead[1], ahead[0]), abs=1e-9)
    assert there.solid.q[7:] == pytest.approx(here.solid.q[7:], abs=1e-9)


def test_a_blend_sets_out_from_the_first_pose_of_the_clip(write: Write) -> None:
    """Not from the pose at rest, with its arms out; what is posed sets out from there."""
    eased = {"unit = 0.01": "unit = 0.01\nblend = 0.3"}
    posed = "[initial]\npositions = { left_shoulder = [1.0, 0.0, 0.0, 0.0] }\n"
    plain, blended, other = (
        build(load_scene(write(append, scene=s))).world
        for append, s in (("", None), ("", eased), (posed, eased))
    )
    assert blended.solid.q == pytest.approx(plain.solid.q, abs=1e-9)
    assert not blended.solid.v.any()
    places = plain.setup.solid.positions_of("left_shoulder")
    assert other.solid.q[places] == pytest.approx([1.0, 0.0, 0.0, 0.0])
    kept = np.setdiff1d(np.arange(plain.solid.q.size), places)
    assert other.solid.q[kept] == pytest.approx(plain.solid.q[kept], abs=1e-9)


def test_a_creature_outside_the_domain_is_told_the_keys_that_place_it(write: Write) -> None:
    domain = "[domain]\nlower = [5.0, -2.0, -1.0]\nupper = [9.0, 2.0, 3.0]\nresolution = 24\n"
    problems = check_scene(write(domain))
    assert "Place the clip by offset and heading in [clip] or enlarge the domain." in problems[0]


def test_controlled_joints_start_where_the_clip_has_them_and_do_not_follow(write: Write) -> None:
    made = built(write(CONTROL))
    model, q = made.world.setup.solid, made.world.solid.q
    (motion,) = made.world.setup.motions
    assert not np.isin(model.dofs_of("lower_back"), motion.dofs).any()
    assert model.dofs_of("left_elbow").size == 1, "a controlled elbow is a hinge"
    assert model.dofs_of("right_elbow").size == 3
    alone = built(write()).world
    back = alone.setup.solid.positions_of("lower_back")
    assert q[model.positions_of("lower_back")] == pytest.approx(alone.solid.q[back], abs=1e-9)
    assert np.degrees(q[model.positions_of("left_elbow")]) == pytest.approx(20.0, abs=26.0)


def test_elbows_go_with_their_shoulders(tmp_path: Path) -> None:
    scene = load_scene("human-gravity-arms", {"human.elbows": "true"})
    assert scene.controlled_joints() == (
        "lower_back",
        *("left_shoulder", "right_shoulder", "left_elbow", "right_elbow"),
    )
    wanted = [table.wanted_by for table in scene.objectives]
    assert wanted[0] == ("lower_back",)
    assert wanted[1] == wanted[2] == ("left_shoulder", "left_elbow")
    again = load_scene(save_scene(scene, tmp_path))
    assert scene_files(again) == scene_files(scene)
    with Simulation(scene) as simulation:
        model = simulation.world.setup.solid
        start = simulation.world.solid.q[model.positions_of("right_elbow")].copy()
        for _ in range(6):
            simulation.advance_frame()
        moved = simulation.world.solid.q[model.positions_of("right_elbow")] - start
        assert 1.0 < np.degrees(np.abs(moved)) < 40.0


def test_what_is_saved_stands_on_its_own(write: Write, tmp_path: Path) -> None:
    scene = load_scene(write(CONTROL))
    saved = save_scene(scene, tmp_path / "elsewhere")
    (tmp_path / "walk.bvh").unlink()
    again = load_scene(saved)
    assert scene_files(again) == {p.name: p.read_bytes() for p in saved.parent.iterdir()}
    assert {"walk.bvh", HUMAN_FILE} < set(scene_files(again))


LEGS = "\n".join(f'{s}_{j} = "{s}_{j}"' for s in ("left", "right") for j in ("hip", "knee"))

FAULTS: dict[str, tuple[str, dict[str, str], dict[str, str], str]] = {
    "a file that is not there": (
        "",
        {"walk.bvh": "wlak.bvh"},
        {},
        "wlak.bvh",
    ),
    "no frames": ("", {}, {"Frames: 127": "Frames: 0"}, "walk.bvh"),
    "fewer frames than it says": ("", {}, {"Frames: 127": "Frames: 900"}, "900"),
    "a unit that is off by 100": ("", {"unit = 0.01": "unit = 1.0"}, {}, "Set unit = 0.01 (cm)."),
    "a knee that nothing names": (
        "",
        {},
        {"JOINT left_knee": "JOINT bone_17"},
        "no joint of the clip is known for left_knee.",
    ),
    "a mapping to what is not there": (
        '[clip.mapping]\nleft_knee = "left_kene"\n',
        {},
        {},
        "the clip has no joint 'left_kene' for 'left_knee'; did you mean 'left_knee'?",
    ),
    "a part that is not in it": (
        "",
        {"unit = 0.01": "unit = 0.01\nstart = 9.0"},
        {},
        "is to go from 9 s to 1.0",
    ),
    "a joint that is controlled and follows": (
        CONTROL,
        {"unit = 0.01": 'unit = 0.01\njoints = ["lower_back"]'},
        {},
        "[clip] joints: joint 'lower_back' is controlled as well. Take it out of one of the two.",
    ),
    "a body and a human": (
        '[solids]\nmodel = "human.xml"\n',
        {},
        {},
        "[human]: there is a [solids] as well. Keep one of the two.",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_one_fault_gives_one_clear_message(write: Write, fault: str) -> None:
    append, scene, clip, message = FAULTS[fault]
    problems = check_scene(write(append, scene, clip))
    assert len(problems) == 1, problems
    assert problems[0].startswith("scene stroll.toml, ["), problems
    assert message in problems[0]
    assert problems[0].endswith((".", "?"))


def test_a_number_that_is_none_is_named(write: Write, walk: str) -> None:
    frame = walk.splitlines()[-3]
    broken = " ".join(["nan", *frame.split()[1:]])
    (problem,) = check_scene(write(clip={frame: broken}))
    assert "walk.bvh" in problem
    assert "nan" in problem.lower()


def test_a_walk_without_a_file_needs_a_human(write: Write) -> None:
    scene = {"[human]\n": "", 'file = "walk.bvh"\n': "", "unit = 0.01\n": ""}
    problems = check_scene(write(scene=scene))
    assert any("a walk without one needs a [human]" in problem for problem in problems)


ARM = """
<mujoco><worldbody><body name="post" pos="0 0 1" euler="0 0 90">
  <body name="upper"><joint name="swing" type="hinge" axis="1 0 0"/>
    <geom type="capsule" size="0.05" fromto="0 0 0 0 0 -0.3"/>
  </body></body></worldbody></mujoco>
"""


def test_any_creature_follows_joints_of_its_own_names(write: Write) -> None:
    path = write('[solids]\nmodel = "arm.xml"\n', {"[human]\n": ""})
    path.with_name("arm.xml").write_text(ARM)
    (problem,) = check_scene(path)
    assert "[clip]: the model has no joint with the name of one of the clip's" in problem
    assert problem.endswith("Say in clip.mapping which of them each follows.")
    path.with_name("arm.xml").write_text(ARM.replace('"swing"', '"left_shoulder"'))
    (motion,) = built(path).world.setup.motions
    assert motion.columns.names == ("left_shoulder",)


def test_any_creature_follows_by_a_mapping_of_its_own(write: Write) -> None:
    path = write(
        '[solids]\nmodel = "arm.xml"\n[clip.mapping]\nswing = "left_shoulder"\n',
        {"[human]\n": ""},
    )
    path.with_name("arm.xml").write_text(ARM)
    world = built(path).world
    (motion,) = world.setup.motions
    clip = read_bvh(path.with_name("walk.bvh"), 0.01)
    arm = clip.rotations[:, clip.names.index("left_shoulder")]
    for frame in (0, 30, 90):
        angle = 2.0 * np.arctan2(arm[frame, 2], arm[frame, 0])  # about the left-pointing axis
        assert motion.position(frame * clip.frame_time) == pytest.approx(angle, abs=1e-6)


def test_a_human_or_a_start_with_a_fault_beside_a_walk_is_told(tmp_path: Path) -> None:
    walk = "gravity = [0.0, 0.0, -9.81]\n[time]\nframes_per_second = 30.0\nframes = 2\n[clip]\n"
    faults = {
        "[human]\nmass = -3": "[human] mass: -3 is not greater than 0",
        '[human]\nsex = "x"': "[human] sex: 'x' is not known",
        "[human]\n[initial]\npositions = { left_kne = 3.0 }": "joint 'left_kne' is not in",
    }
    for fault, said in faults.items():
        (tmp_path / "walk.toml").write_text(f"{walk}{fault}\n")
        (problem,) = check_scene(tmp_path / "walk.toml")
        assert said in problem


def t_posed(path: Path) -> None:
    """Put a frame before the first, in which both arms are held sideways."""
    lines = path.read_text().splitlines()
    at = next(n for n, line in enumerate(lines) if line.startswith("Frames"))
    count = int(lines[at].split()[-1])
    numbers = np.array(lines[at + 2].split(), float)
    joints = [line.split()[-1] for line in lines if line.split()[:1] in (["ROOT"], ["JOINT"])]
    for joint, turn in (("left_shoulder", 80.0), ("right_shoulder", -80.0)):
        numbers[3 + 3 * joints.index(joint)] += turn
    lines[at] = f"Frames: {count + 1}"
    lines.insert(at + 2, " ".join(map(str, numbers)))
    path.write_text("\n".join(lines) + "\n")


def test_a_t_pose_before_the_clip_is_named_with_its_cure(write: Write, tmp_path: Path) -> None:
    path = write()
    assert check_scene(path) == []
    t_posed(tmp_path / "walk.bvh")
    (problem,) = check_scene(path)
    assert "[clip]: from the first frame that is used of walk.bvh to the second" in problem
    assert "_shoulder' turns by 80 degrees" in problem
    assert problem.endswith("Drop it by skip = 1.")
    assert check_scene(path, {"clip.skip": "1"}) == []
    assert check_scene(path, {"clip.smooth": "6.0"}) == []


def test_a_clip_shorter_than_the_run_says_where_it_stands_still(write: Write) -> None:
    path = write()
    for settings, told in (
        ({"time.frames": "240"}, True),
        ({"time.frames": "240", "clip.loop": "true", "clip.blend": "0.2"}, False),
        ({"time.frames": "4"}, False),
        ({"time.frames": "20", "clip.start": "0.5"}, True),
    ):
        scene = load_scene(path, settings)
        notes = list(notes_of(scene, build(scene).world.setup.solid))
        assert len(notes) == told, settings
    assert "walk.bvh goes on for 0.55 s of the run's 0.833 s, and stands still" in notes[0]


def test_a_clip_with_the_wrong_axis_up_is_told_the_other(write: Write) -> None:
    (problem,) = check_scene(write(), {"clip.up": "z"})
    assert problem == (
        "scene stroll.toml, [clip]: with up = 'z' its legs do not point down when no joint is "
        "turned. Set up = 'y', or correct the mapping."
    )
