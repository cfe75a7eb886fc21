"""BVH in: what a file of any make says, and what is said when it is wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from flowborne.base.errors import SceneError
from flowborne.motion.bvh import TO_WORLD
from flowborne.motion.bvh_file import load_bvh

from ..read_bvh import read_bvh
from .bvh_texts import CHAIN, Written, written

MOCAP = Path(__file__).parents[3] / "shared" / "mocap"
CMU = 0.056444

in_one_folder = settings(
    max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "clip.bvh"


@in_one_folder
@given(written())
def test_any_make_of_file_says_the_same_as_its_numbers(path: Path, file: Written) -> None:
    path.write_bytes(file.raw)
    clip = read_bvh(path, unit=0.01)
    assert list(clip.names) == file.names
    assert clip.parents.tolist() == file.parents
    assert clip.frame_time == 0.0083333
    places, rotations = clip.poses()
    world: list[Rotation] = []
    joints: list[np.ndarray] = []
    for joint, parent in enumerate(file.parents):
        above = world[parent] if joint else None
        world.append(above * file.rotations[joint] if above is not None else file.rotations[0])
        step = above.apply(file.offsets[joint]) if above is not None else file.places
        joints.append(joints[parent] + step if joint else step)
        back = Rotation.from_quat(rotations[:, joint], scalar_first=True).as_matrix()
        C = TO_WORLD["y"]
        assert_allclose(back, C @ world[joint].as_matrix() @ C.T, atol=1e-9)
        assert_allclose(places[:, joint], 0.01 * joints[joint] @ C.T, atol=1e-9)


def test_world_is_z_up_x_forward_y_left(path: Path) -> None:
    path.write_text(CHAIN)
    clip = read_bvh(path, unit=0.1)
    assert_allclose(clip.translation[1], [0.1, 0.01, 0.9])
    assert_allclose(clip.offsets, [[0, 0, 0], [0.05, 0, -0.4]])
    assert_allclose(clip.ends["Left Knee"], [0, 0, -0.3])
    places, _ = clip.poses(2)
    turned_left = places[1] - places[0]  # by 90 degrees about the vertical: ahead comes to the left
    assert_allclose(turned_left, [0.0, 0.05, -0.4], atol=1e-15)


def test_where_z_is_up_left_is_x_and_the_face_is_to_minus_y(path: Path) -> None:
    path.write_text(CHAIN.replace("0.2 9 1 ", "1 -2 3 "))
    assert_allclose(read_bvh(path, up="z").translation[2], [2.0, 1.0, 3.0])


def test_skipped_frames_are_gone(path: Path) -> None:
    path.write_text(CHAIN)
    clip = read_bvh(path, skip=1)
    assert clip.frames == 2
    assert clip.duration == pytest.approx(0.0083333)
    assert_allclose(clip.translation[:, 1], [0.1, 0.2])


def test_a_single_frame_is_as_in_all(path: Path) -> None:
    path.write_text(CHAIN)
    clip = read_bvh(path)
    for one, all_frames in zip(clip.poses(1), clip.poses(), strict=True):
        assert np.array_equal(one, all_frames[1])


def test_position_channels_of_a_bone_may_be_a_small_way_beside_its_offset(path: Path) -> None:
    text = CHAIN.replace(
        "3 Zrotation Yrotation Xrotation", "4 Yposition Zrotation Yrotation Xrotation"
    )
    for row in ("-0.25", "-4.25"):  # beside the offset, or in its place
        path.write_text(
            text.replace("  10 20", f"  {row} 10 20")
            .replace("  11 21", f"  {row} 11 21")
            .replace("  12 22", f"  {row} 12 22")
        )
        assert_allclose(read_bvh(path).offsets[1], [0.5, 0.0, -4.25])


def test_stretching_bone_is_refused_with_its_line(path: Path) -> None:
    text = CHAIN.replace(
        "3 Zrotation Yrotation Xrotation", "4 Yposition Zrotation Yrotation Xrotation"
    )
    text = text.replace("  10 20", "  -4 10 20").replace("  11 21", "  -4 11 21")
    path.write_text(text.replace("  12 22", "  -4.5 12 22"))
    with pytest.raises(SceneError, match=r"line 19.*'Left Knee' move by 0.05 m"):
        read_bvh(path, unit=0.1)
    read_bvh(path, unit=0.001)  # half a millimetre


@pytest.mark.parametrize(
    ("change", "frames", "note"),
    [
        (lambda t: t[: t.index("0.2 9")], 2, "says 3 frames and has 2"),
        (lambda t: t[:-9], 2, "says 3 frames and has 2 and 6 of the 9 values of another, left out"),
        (lambda t: t.replace("Frames: 3", "Frames: 2"), 3, "says 2 frames and has 3"),
        (lambda t: t.replace("Frames: 3", "Frames: 0"), 3, "says 0 frames and has 3"),
        (lambda t: t, 3, ""),
    ],
)
def test_a_wrong_number_of_frames_is_a_note(path: Path, change, frames: int, note: str) -> None:
    path.write_text(change(CHAIN))
    assert read_bvh(path).frames == frames
    assert load_bvh(path).note == note


FOLDED = CHAIN.replace(
    "CHANNELS 3 Zrotation Yrotation Xrotation",
    "CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation",
).replace("OFFSET 0 -4 0.5", "OFFSET 0 0 0")


def test_a_root_in_which_the_next_joint_moves_is_folded_into_it(path: Path) -> None:
    """Both turn and move: hips below a root that says where the character is."""
    rows = [np.array(row.split(), float) for row in FOLDED.splitlines()[-3:]]
    moving = [[*row[:6], -2.0 * n, 1.0 + n, n, *row[6:]] for n, row in enumerate(rows)]
    text = "\n".join(" ".join(map(str, row)) for row in moving)
    path.write_text("\n".join(FOLDED.splitlines()[:-3]) + "\n" + text + "\n")
    clip = read_bvh(path, unit=0.1)
    assert clip.names == ("Left Knee",)
    for n, row in enumerate(rows):
        root = Rotation.from_euler("ZXY", row[3:6], degrees=True)
        place = row[:3] + root.apply([-2.0 * n, 1.0 + n, n])
        turn = root * Rotation.from_euler("ZYX", row[6:], degrees=True)
        C = TO_WORLD["y"]
        assert_allclose(clip.translation[n], 0.1 * C @ place, atol=1e-12)
        found = Rotation.from_quat(clip.rotations[n, 0], scalar_first=True).as_matrix()
        assert_allclose(found, C @ turn.as_matrix() @ C.T, atol=1e-12)


@pytest.mark.parametrize("up", TO_WORLD)
def test_axes_that_are_up_are_turned_and_not_mirrored(path: Path, up: str) -> None:
    path.write_text(CHAIN)
    axis = "xyz".index(up[-1])
    assert TO_WORLD[up][2, axis] == (-1.0 if up.startswith("-") else 1.0)
    assert np.linalg.det(TO_WORLD[up]) == pytest.approx(1.0)
    assert_allclose(read_bvh(path, up=up).translation[2], TO_WORLD[up] @ [0.2, 9.0, 1.0])


WRONG = {
    "not BVH": (lambda t: "skeleton\n" + t, r"does not begin with HIERARCHY"),
    "empty": (lambda t: "", r"does not begin with HIERARCHY"),
    "hierarchy cut": (lambda t: t[:120], r"ends in line 6, before MOTION: it is cut"),
    "cut after MOTION": (lambda t: t[: t.index("Frames")], r"ends after MOTION: it is cut"),
    "brace missing": (
        lambda t: t.replace("}\nMOTION", "MOTION"),
        r"line 15: MOTION before the last",
    ),
    "no frame": (lambda t: t[: t.index("0 9 1")], r"has no frame"),
    "no frames": (lambda t: t.replace("Frames: 3", "Frames: x"), r"line 17: not 'Frames: '"),
    "frame time 0": (lambda t: t.replace("0.0083333", "0"), r"line 18: 'Frame Time: 0' gives no"),
    "frame time -1": (lambda t: t.replace("0.0083333", "-1"), r"line 18: .* above 0 s"),
    "frame time NaN": (lambda t: t.replace("0.0083333", "nan"), r"line 18: .* above 0 s"),
    "NaN": (
        lambda t: t.replace("11 21", "11 nan"),
        r"line 20: 'nan' in frame 2, joint 'Left Knee'",
    ),
    "infinity": (lambda t: t.replace("0.1 9", "0.1 -inf"), r"line 20: '-inf' .* joint 'Hips'"),
    "word": (lambda t: t.replace("0.1 9", "0,1 9"), r"line 20: '0,1' in frame 2"),
    "short line": (
        lambda t: t.replace("0.1 9 1", "0.1 9"),
        r"line 20: frame 2 has 8 values .* 9 ch",
    ),
    "long line": (lambda t: t.replace("0.1 9 1", "0.1 9 1 4"), r"line 20: frame 2 has 10 values"),
    "twice": (
        lambda t: t.replace("Left Knee", "Hips"),
        r"line 6: joint 'Hips' is already in line 2",
    ),
    "two roots": (
        lambda t: t.replace("MOTION", "ROOT Other\n{\n}\nMOTION"),
        r"line 16: a second ROOT",
    ),
    "bad channel": (lambda t: t.replace("Yposition", "Yscale"), r"line 5: channel 'Yscale'"),
    "bad count": (
        lambda t: t.replace("CHANNELS 3", "CHANNELS 4"),
        r"line 9: CHANNELS says 4 and na",
    ),
    "huge offset": (
        lambda t: t.replace("0 -4 0.5", "0 -4 1e164"),
        r"line 8: OFFSET '0 -4 1e164' is not three numbers of at most 1e\+09",
    ),
    "bad offset": (lambda t: t.replace("0 -4 0.5", "0 -4"), r"line 8: OFFSET '0 -4' is not three"),
    "no offset": (
        lambda t: t.replace("OFFSET 0 -4 0.5\n", "\n"),
        r"line 6: 'Left Knee' has no OFFS",
    ),
    "odd word": (lambda t: t.replace("End Site", "Tip"), r"line 10: 'Tip' is not expected"),
    "no brace": (
        lambda t: t.replace("Hips\n{", "Hips\n"),
        r"line 4: 'OFFSET 0 0 0' is not the expected brace",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_file_is_told_in_one_message(path: Path, case: str) -> None:
    spoil, message = WRONG[case]
    text = spoil(CHAIN)
    assert text != CHAIN
    path.write_text(text)
    with pytest.raises(SceneError, match=message) as caught:
        read_bvh(path)
    assert str(path) in str(caught.value)
    assert len(caught.value.problems) == 1


def test_missing_file_and_binary_file(path: Path) -> None:
    with pytest.raises(SceneError, match="there is no file"):
        read_bvh(path)
    path.write_bytes(bytes(range(256)))
    with pytest.raises(SceneError, match="does not begin with HIERARCHY"):
        read_bvh(path)


def test_skipping_all_frames_is_refused(path: Path) -> None:
    path.write_text(CHAIN)
    with pytest.raises(SceneError, match="has 3 frames, and skip = 3 leaves none"):
        read_bvh(path, skip=3)


@pytest.mark.skipif(not MOCAP.is_dir(), reason="the real clips are not here")
def test_real_walk_bends_knees_as_people_do() -> None:
    clip = read_bvh(MOCAP / "02_01.bvh", CMU, skip=1)
    places, _ = clip.poses()
    for side in ("Left", "Right"):
        joints = [clip.names.index(side + bone) for bone in ("UpLeg", "Leg", "Foot", "ToeBase")]
        hip, knee, ankle, toes = np.moveaxis(places[:, joints], 1, 0)
        thigh, shank = knee - hip, ankle - knee
        lengths = np.linalg.norm(thigh, axis=1) * np.linalg.norm(shank, axis=1)
        flexion = np.rad2deg(np.arccos(np.sum(thigh * shank, axis=1) / lengths))
        assert 70.0 < flexion.max() < 78.0
        assert 0.0 < toes[:, 2].min() < 0.05
        assert 0.03 < ankle[:, 2].min() < 0.1
    travelled = clip.translation[-1] - clip.translation[0]
    assert travelled[0] / clip.duration == pytest.approx(1.18, abs=0.05)
    assert abs(travelled[1]) < 0.2


@pytest.mark.skipif(not MOCAP.is_dir(), reason="the real clips are not here")
def test_real_clip_in_metres_is_the_one_in_its_own_unit() -> None:
    own = read_bvh(MOCAP / "131_01.bvh", CMU, skip=1)
    metres = read_bvh(MOCAP / "131_01_metres.bvh", skip=1)
    assert own.frames == 993
    assert own.names == metres.names
    assert_allclose(metres.offsets, own.offsets, atol=2e-6)
