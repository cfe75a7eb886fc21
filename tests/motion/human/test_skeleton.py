"""The standard skeleton, and skeletons of clips."""

from pathlib import Path

import numpy as np
import pytest

from flowborne.base.errors import SceneError
from flowborne.motion.clip import Clip
from flowborne.motion.human.body import human_mjcf
from flowborne.motion.human.clip_skeleton import lost_bones, skeleton_of
from flowborne.motion.human.skeleton import JOINTS, PARENTS, TIPS, Skeleton, standard_skeleton
from flowborne.motion.mapping import mapping_of
from flowborne.solids.model import SolidModel

from ...read_bvh import read_bvh

MOCAP = Path(__file__).parents[4] / "shared" / "mocap"


def distance(skeleton, start, end):
    return np.linalg.norm(skeleton[end] - skeleton[start])


def clip_of(skeleton, left_out=()):
    """A clip of one frame with the skeleton's bones, less some joints; names in capitals."""
    kept = [name for name in JOINTS if name not in left_out]
    parents, offsets = [], []
    for name in kept:
        above = PARENTS.get(name)
        while above is not None and above not in kept:
            above = PARENTS[above]
        parents.append(-1 if above is None else kept.index(above))
        offsets.append(np.zeros(3) if above is None else skeleton[name] - skeleton[above])
    ends = {
        joint.upper(): skeleton[tip] - skeleton[joint]
        for tip, joint in TIPS.items()
        if joint in kept and tip not in left_out
    }
    still = np.tile([1.0, 0.0, 0.0, 0.0], (1, len(kept), 1))
    names = tuple(name.upper() for name in kept)
    place = np.zeros((1, 3))
    clip = Clip(names, np.array(parents), np.array(offsets), ends, 0.01, still, place)
    return clip, {name: name.upper() for name in kept}


def difference(skeleton, other):
    """Largest distance between two skeletons whose roots are put together."""
    shift = other["root"] - skeleton["root"]
    return max(np.linalg.norm(skeleton[name] + shift - other[name]) for name in (*JOINTS, *TIPS))


@pytest.mark.parametrize("height", [1.2, 1.741, 2.0])
def test_standard_skeleton_has_de_levas_lengths(height):
    skeleton, scale = standard_skeleton(height), height / 1.741
    lengths = {
        ("left_hip", "left_knee"): 0.4222,
        ("right_knee", "right_ankle"): 0.4340,
        ("left_shoulder", "left_elbow"): 0.2817,
        ("right_elbow", "right_wrist"): 0.2689,
        ("lower_neck", "head_top"): 0.2429,
    }
    for (start, end), length in lengths.items():
        assert distance(skeleton, start, end) == pytest.approx(scale * length, rel=1e-12)
    trunk = np.linalg.norm(skeleton["lower_neck"] - skeleton.mid_hip)
    assert trunk == pytest.approx(scale * 0.6033, rel=1e-12)
    foot = np.linalg.norm(skeleton["left_toe_tip"] - skeleton.heel("left"))
    assert foot == pytest.approx(scale * 0.2581, rel=1e-12)
    hand = np.linalg.norm(skeleton.knuckle("left") - skeleton["left_wrist"])
    assert hand == pytest.approx(scale * 0.0862, rel=1e-12)
    assert skeleton["head_top"][2] == pytest.approx(height, rel=1e-12)


def test_standard_skeleton_is_its_own_mirror_image():
    skeleton = standard_skeleton()
    for name in (*JOINTS, *TIPS):
        twin = (
            name.replace("left_", "other_").replace("right_", "left_").replace("other_", "right_")
        )
        np.testing.assert_allclose(skeleton[name] * [1, -1, 1], skeleton[twin], atol=1e-15)


def test_standard_skeleton_refuses_no_height():
    with pytest.raises(ValueError, match=r"0\.0 m tall"):
        standard_skeleton(0.0)


def test_complete_clip_gives_its_own_bones():
    wanted = standard_skeleton(1.6)
    assert difference(skeleton_of(*clip_of(wanted)), wanted) < 1e-12


@pytest.mark.parametrize(
    "left_out",
    [
        ("upper_back",),
        ("left_clavicle", "right_clavicle", "upper_neck"),
        ("left_toes", "right_toes"),
        ("head_top", "left_fingertip", "left_toe_tip"),
        tuple(name for name in JOINTS if not name.endswith(("root", "hip", "knee", "ankle"))),
    ],
)
def test_missing_joints_are_filled_in_by_the_standard(left_out):
    wanted = standard_skeleton(1.9)
    assert difference(skeleton_of(*clip_of(wanted, left_out)), wanted) < 1e-9


def test_missing_hand_follows_a_raised_arm():
    standard = standard_skeleton()
    joints = dict(standard.joints)
    joints["left_elbow"] = joints["left_shoulder"] + [0.0, 0.2817, 0.0]
    joints["left_wrist"] = joints["left_elbow"] + [0.0, 0.2689, 0.0]
    clip = clip_of(Skeleton(joints, standard.tips), ("left_fingertip",))
    skeleton = skeleton_of(*clip)
    hand = skeleton["left_fingertip"] - skeleton["left_wrist"]
    np.testing.assert_allclose(hand, [0.0, 0.1879, 0.0], atol=1e-9)


def test_lost_thorax_bone_is_put_in():
    """As in files of the CMU database: neck and collar bones lie on the thorax's joint."""
    wanted = standard_skeleton()
    clip, mapping = clip_of(wanted)
    offsets = clip.offsets.copy()
    starts = ("lower_neck", "left_clavicle", "right_clavicle")
    for joint in starts:
        offsets[clip.names.index(joint.upper())] = 0.0
    lost = Clip(
        clip.names, clip.parents, offsets, clip.ends, 0.01, clip.rotations, np.zeros((1, 3))
    )
    assert lost_bones(clip, mapping) == []
    assert sorted(lost_bones(lost, mapping)) == sorted(starts)
    found = skeleton_of(lost, mapping)
    assert distance(found, "thorax", "lower_neck") == pytest.approx(
        distance(wanted, "thorax", "lower_neck"), rel=1e-9
    )
    for end in ("head_top", "left_shoulder", "right_shoulder"):
        heights = [s[end][2] - s["thorax"][2] for s in (found, wanted)]
        assert heights[0] == pytest.approx(heights[1], abs=0.01)
    np.testing.assert_allclose(
        found["left_shoulder"] - found["left_clavicle"],
        wanted["left_shoulder"] - wanted["left_clavicle"],
        atol=1e-12,
    )
    assert SolidModel.from_string(human_mjcf(found, 70.0, "male")).nbody == 24


def test_a_hand_has_the_forearms_proportion_wherever_the_clip_ends_it():
    clip, mapping = clip_of(standard_skeleton())
    ends = {name: 0.3 * end if "WRIST" in name else end for name, end in clip.ends.items()}
    cut = Clip(clip.names, clip.parents, clip.offsets, ends, 0.01, clip.rotations, np.zeros((1, 3)))
    assert difference(skeleton_of(cut, mapping), standard_skeleton()) < 1e-9


def test_joints_at_one_point_are_refused():
    clip, mapping = clip_of(standard_skeleton())
    flat = Clip(
        clip.names, clip.parents, 0.0 * clip.offsets, {}, 0.01, clip.rotations, np.zeros((1, 3))
    )
    with pytest.raises(SceneError, match="at one point"):
        skeleton_of(flat, mapping)


@pytest.mark.skipif(not MOCAP.is_dir(), reason="no motion capture beside the repository")
@pytest.mark.parametrize("name", ["02_01.bvh", "131_01.bvh"])
def test_shoulders_of_cmu_clips_are_below_the_jaw(name):
    """As far below the crown as those of the standard skeleton, though the files lack the bone."""
    clip = read_bvh(MOCAP / name, 0.056444, skip=1)
    mapping = mapping_of(clip, {})
    assert set(lost_bones(clip, mapping)) == {"lower_neck", "left_clavicle", "right_clavicle"}
    found, standard = skeleton_of(clip, mapping), standard_skeleton()
    legs = [distance(s, "left_hip", "left_knee") for s in (found, standard)]
    for side in ("left", "right"):
        low, usual = (s["head_top"][2] - s[f"{side}_shoulder"][2] for s in (found, standard))
        assert low / usual == pytest.approx(legs[0] / legs[1], abs=0.1)


@pytest.mark.skipif(not MOCAP.is_dir(), reason="no motion capture beside the repository")
def test_real_clip_gives_a_person():
    clip = read_bvh(MOCAP / "131_01_metres.bvh", skip=1)
    names = {
        "root": "Hips",
        "lower_back": "lowerback",
        "upper_back": "Chest",
        "thorax": "Chest2",
        "lower_neck": "lowerneck",
        "upper_neck": "Neck",
        "head": "Head",
    }
    limbs = ("hip", "knee", "ankle", "clavicle", "shoulder", "elbow", "wrist", "toes")
    theirs = ("Hip", "Knee", "Ankle", "Collar", "Shoulder", "Elbow", "Wrist", "Toe")
    for side in ("left", "right"):
        for joint, name in zip(limbs, theirs, strict=True):
            names[f"{side}_{joint}"] = side.capitalize() + name
    skeleton = skeleton_of(clip, names)
    assert distance(skeleton, "left_hip", "left_knee") == pytest.approx(0.4115, abs=1e-3)
    assert distance(skeleton, "right_knee", "right_ankle") == pytest.approx(0.3935, abs=1e-3)
    assert 0.2 < np.linalg.norm(skeleton["left_toe_tip"] - skeleton.heel("left")) < 0.28
    assert 0.12 < distance(skeleton, "left_wrist", "left_fingertip") < 0.2
    legs = distance(skeleton, "left_hip", "left_knee") + distance(
        skeleton, "left_knee", "left_ankle"
    )
    trunk = np.linalg.norm(skeleton["lower_neck"] - skeleton.mid_hip)
    assert 0.5 < trunk / legs < 0.8
    model = SolidModel.from_string(human_mjcf(skeleton, 65.0, "female"))
    assert model.body_mass.sum() == pytest.approx(65.0)
