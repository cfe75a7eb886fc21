"""A scene's clip: its human, who follows it, and what is said of a clip that cannot be used."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flowborne.motion.bvh import TO_WORLD, write_clip
from flowborne.motion.human.gait import gait_clip
from flowborne.motion.human.skeleton import standard_skeleton
from flowborne.motion.quaternions import product
from flowborne.scenes.build import Built, build
from flowborne.scenes.capture import capture_of, followers
from flowborne.scenes.load import check_scene, load_scene
from flowborne.scenes.notes import clip_notes, notes_of
from flowborne.scenes.save import HUMAN_FILE, scene_files
from flowborne.scenes.warn import lying
from flowborne.sim.simulation import Simulation

from ..read_bvh import read_bvh
from .saved import save_scene

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
    "a file that is not there": ("", {"walk.bvh": "wlak.bvh"}, {}, "wlak.bvh"),
    "a unit that is off by 100": (
        "",
        {"unit = 0.01": "unit = 1.0"},
        {},
        "Set unit = 0.01 (cm), or leave",
    ),
    "a knee that nothing names": (
        "",
        {},
        {"JOINT left_knee": "JOINT bone_17"},
        "no joint of the clip is known for left_knee (looked for: knee, tibia, leg,",
    ),
    "an elbow that nothing names": (
        "",
        {},
        {"JOINT right_elbow": "JOINT bone_18"},
        "no joint of the clip is known for right_elbow (looked for: elbow, radius, forearm,",
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
        "but start is 9 s and stop 1.0",
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
        '[solids]\nmodel = "arm.xml"\n[clip.mapping]\nswing = "left_shoulder"\n', {"[human]\n": ""}
    )
    path.with_name("arm.xml").write_text(ARM)
    world = built(path).world
    (motion,) = world.setup.motions
    clip = read_bvh(path.with_name("walk.bvh"), 0.01)
    arm = clip.rotations[:, clip.names.index("left_shoulder")]
    for frame in (0, 30, 90):
        angle = 2.0 * np.arctan2(arm[frame, 2], arm[frame, 0])  # about the left-pointing axis
        assert motion.position(frame * clip.frame_time) == pytest.approx(angle, abs=1e-6)


def test_a_held_joint_does_not_follow(write: Write) -> None:
    """By the name of its free joint, or as "root", a creature is held while its limbs move."""
    floating = ARM.replace(
        '<body name="upper">', '<freejoint name="trunk"/><geom size="0.1"/>\n<body name="upper">'
    )
    mapped = '[clip.mapping]\ntrunk = "root"\nswing = "left_shoulder"\n'
    for hold, names in (("trunk", ["swing"]), ("root", ["swing"]), ("swing", ["trunk"])):
        path = write(f'[solids]\nmodel = "arm.xml"\nhold = ["{hold}"]\n{mapped}', {"[human]\n": ""})
        path.with_name("arm.xml").write_text(floating)
        motion, still = built(path).world.setup.motions
        assert list(motion.columns.names) == names
        np.testing.assert_array_equal(still.velocity(0.5), np.zeros(len(still.dofs)))
    (problem,) = check_scene(path, {"clip.joints": '["swing"]'})
    assert "[clip] joints: joint 'swing' is held as well" in problem


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


def warned(path: Path, settings: dict[str, str]) -> tuple[list[str], list[str]]:
    """Warnings and notes about the clip of a scene without a fault."""
    scene = load_scene(path, settings)
    setup = build(scene).world.setup
    return list(lying(scene, setup)), list(clip_notes(scene))


def test_a_walker_who_lies_is_told_the_axis_that_makes_it_stand(write: Write) -> None:
    path = write()
    assert warned(path, {"clip.up": "z"})[0] == [
        "[clip]: with up = 'z' the person of walk.bvh lies; up = 'y' makes it stand"
    ]
    for up in ("y", "auto"):
        assert warned(path, {"clip.up": up}) == ([], [])


def test_a_swimmer_is_told_to_lie_and_no_axis_that_would_be_refused(write: Write) -> None:
    """A person who lies along the line from side to side, which no axis of the file makes stand."""
    path = write(scene={"unit = 0.01\n": ""})
    clip = read_bvh(path.with_name("walk.bvh"), 0.01)
    over = np.array([np.cos(np.pi / 4), np.sin(np.pi / 4), 0.0, 0.0])
    rotations = clip.rotations.copy()
    rotations[:, 0] = product(over, rotations[:, 0])
    write_clip(path.with_name("walk.bvh"), replace(clip, rotations=rotations), 0.01)
    assert check_scene(path) == []
    warnings, notes = warned(path, {})
    assert warnings == []
    assert notes[1:] == [
        "[clip]: the person of walk.bvh lies rather than stands, whichever axis is up"
    ]


def test_limbs_on_a_line_are_refused(write: Write) -> None:
    path = write()
    lines = path.with_name("walk.bvh").read_text().splitlines()
    for n, line in enumerate(lines):
        if line.split()[:1] == ["OFFSET"]:
            y = line.split()[2]
            lines[n] = f"OFFSET 0 {y} 0"
    at = next(n for n, line in enumerate(lines) if line.startswith("Frame Time"))
    lines[at + 1 :] = [" ".join("0" for _ in row.split()) for row in lines[at + 1 :]]
    path.with_name("walk.bvh").write_text("\n".join(lines) + "\n")
    (problem,) = check_scene(path)
    assert problem == (
        "scene stroll.toml, [clip]: its hips, shoulders and ankles are on one line. "
        "Correct the mapping or the file."
    )


@pytest.mark.parametrize("up", ["y", "z", "-y"])
def test_the_axis_that_is_up_and_the_unit_are_found(write: Write, up: str) -> None:
    """Of one walk, in feet, whose file has its axes swapped or is upside down."""
    path = write(scene={"unit = 0.01\n": ""})
    clip = read_bvh(path.with_name("walk.bvh"), 0.01)
    back = TO_WORLD["y"].T @ TO_WORLD[up]  # writes what `up` would turn back
    axes = TO_WORLD["y"] @ back.T @ TO_WORLD["y"].T
    turned = replace(
        clip,
        offsets=clip.offsets @ axes.T,
        ends={name: axes @ end for name, end in clip.ends.items()},
        rotations=np.concatenate([clip.rotations[..., :1], clip.rotations[..., 1:] @ axes.T], -1),
        translation=clip.translation @ axes.T,
    )
    write_clip(path.with_name("walk.bvh"), turned, 0.3048)
    capture = capture_of(load_scene(path))
    assert capture is not None
    assert (capture.unit, capture.up) == (0.3048, up)
    _, (note,) = warned(path, {})
    said = "walk.bvh is read with unit = 0.3048 (feet), which makes legs of 0.86 m"
    assert note == f"[clip]: {said}" + (f", and up = '{up}'" if up != "y" else "")
    walked = capture.clip.translation
    assert walked - walked[0] == pytest.approx(clip.translation - clip.translation[0], abs=0.01)


def test_a_wrong_number_of_frames_is_a_note(write: Write) -> None:
    path = write(clip={"Frames: 127": "Frames: 900"})
    assert check_scene(path) == []
    assert warned(path, {})[1] == ["[clip]: walk.bvh says 900 frames and has 127"]


def test_a_bone_that_is_put_in_is_told_with_its_length(write: Write) -> None:
    """Of the neck of a file that starts it on the thorax itself."""
    path = write()
    lines = path.with_name("walk.bvh").read_text().splitlines()
    at = next(n for n, line in enumerate(lines) if "JOINT lower_neck" in line) + 2
    assert "OFFSET" in lines[at]
    lines[at] = "OFFSET 0 0 0"
    path.with_name("walk.bvh").write_text("\n".join(lines) + "\n")
    _, (note,) = warned(path, {})
    assert re.search(r"no bone above 'lower_neck', as .*; one of 2\d cm is put in", note), note


@pytest.mark.parametrize(
    ("most", "told"),
    [
        (0.5, "bones of walk.bvh stretch, that to 'left_knee' by 10 mm; each has its middle"),
        (3.0, "the position channels of joint 'left_knee' move by 0.06 m"),
    ],
)
def test_bones_that_stretch_a_little_have_their_middle(
    write: Write, walk: str, most: float, told: str
) -> None:
    """By channels of position that go up and down by some centimetres."""
    path = write()
    head, motion = walk.split("MOTION")
    joints = [line.split()[-1] for line in head.splitlines() if "JOINT" in line]
    column = 6 + 3 * joints.index("left_knee")
    before, after = head.split("JOINT left_knee", 1)
    height = float(after.split("OFFSET", 1)[1].split()[1])
    after = after.replace("CHANNELS 3", "CHANNELS 4 Yposition", 1)
    rows = motion.strip().splitlines()
    for n, row in enumerate(rows[2:], start=2):
        words = row.split()
        words.insert(column, f"{height + most * (-1) ** n:.6f}")
        rows[n] = " ".join(words)
    text = "\n".join([f"{before}JOINT left_knee{after}MOTION", *rows])
    path.with_name("walk.bvh").write_text(text + "\n")
    said = check_scene(path) or warned(path, {})[1]
    assert len(said) == 1
    assert told in said[0]


def test_a_joint_that_the_clip_lacks_and_the_scene_names_is_held_until_it_is_moved(
    write: Write,
) -> None:
    """Toes of a clip without any: welded, or controlled from the pose in which they are held."""
    lacking = {"JOINT upper_neck": "JOINT cervix"}
    path = write(clip=lacking | {"JOINT lower_neck": "JOINT neck"})
    scene = load_scene(path)
    capture = capture_of(scene)
    assert capture is not None
    assert "upper_neck" not in capture.held, "found by its place"
    path = write(clip={"JOINT left_toes": "JOINT digits"})
    alone = build(load_scene(path)).world.setup.solid
    assert "left_toes" not in alone.joint_names
    assert alone.nbody == 24
    control = CONTROL.replace('"lower_back", "left_elbow"', '"left_toes"')
    path = write(control, clip={"JOINT left_toes": "JOINT digits"})
    assert "[clip]: not in walk.bvh, held: left_toes" in warned(path, {})[1]
    world = built(path).world
    model = world.setup.solid
    assert model.dofs_of("left_toes").size == 3
    assert world.solid.q[model.positions_of("left_toes")] == pytest.approx([1.0, 0.0, 0.0, 0.0])
