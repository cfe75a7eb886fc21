"""Guessing which joint is which, in the names of the tools in use."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.errors import SceneError
from flowborne.io.clip import Clip
from flowborne.scenes.mapping import JOINTS, NEEDED, mapping_of


def clip_named(names: str) -> Clip:
    """A chain of joints with these names."""
    words = tuple(names.split())
    count = len(words)
    still = np.tile([1.0, 0.0, 0.0, 0.0], (1, count, 1))
    zeros = np.zeros((1, 3))
    return Clip(words, np.arange(count) - 1, np.zeros((count, 3)), {}, 0.01, still, zeros)


def sides(names: str, left: str, right: str) -> str:
    return " ".join(names.replace("*", side) for side in (left, right))


MAX = "Hips " + sides("*Hip *Knee *Ankle *Toe *Collar *Shoulder *Elbow *Wrist", "Left", "Right")
HUMANIK = sides(
    "*UpLeg *Leg *Foot *ToeBase *Shoulder *Arm *ForeArm *Hand *HandIndex1", "Left", "Right"
)
CONVENTIONS = {
    "cmu for max": (
        "lowerback Chest Chest2 lowerneck Neck Head lhand rhand LThumb RThumb LHipJoint " + MAX,
        {
            "root": "Hips",
            "lower_back": "lowerback",
            "upper_back": "Chest",
            "thorax": "Chest2",
            "lower_neck": "lowerneck",
            "upper_neck": "Neck",
            "left_clavicle": "LeftCollar",
            "right_shoulder": "RightShoulder",
            "left_wrist": "lhand",
            "right_wrist": "rhand",
        },
        23,
    ),
    "cmu for motionbuilder": (
        "Hips LowerBack Spine Spine1 Neck Neck1 Head LHipJoint " + HUMANIK,
        {
            "lower_back": "LowerBack",
            "upper_back": "Spine",
            "thorax": "Spine1",
            "upper_neck": "Neck1",
            "left_hip": "LeftUpLeg",
            "left_clavicle": "LeftShoulder",
            "left_shoulder": "LeftArm",
            "right_wrist": "RightHand",
        },
        23,
    ),
    "asf": (
        "root lhipjoint rhipjoint lowerback upperback thorax lowerneck upperneck head "
        + sides("*femur *tibia *foot *toes *clavicle *humerus *radius *wrist *hand", "l", "r"),
        {"left_hip": "lfemur", "right_knee": "rtibia", "left_elbow": "lradius"}
        | {"left_wrist": "lhand", "thorax": "thorax", "root": "root"},
        23,
    ),
    "mixamo": (
        " ".join(
            "mixamorig:" + name
            for name in f"Hips Spine Spine1 Spine2 Neck Head HeadTop_End {HUMANIK}".split()
        ),
        {
            "root": "mixamorig:Hips",
            "lower_back": "mixamorig:Spine",
            "upper_back": "mixamorig:Spine1",
            "thorax": "mixamorig:Spine2",
            "lower_neck": "mixamorig:Neck",
            "left_knee": "mixamorig:LeftLeg",
            "left_clavicle": "mixamorig:LeftShoulder",
            "left_shoulder": "mixamorig:LeftArm",
            "left_toes": "mixamorig:LeftToeBase",
        },
        22,
    ),
    "mixamo without its prefix": (
        f"Hips Spine Spine1 Spine2 Neck Head {HUMANIK}",
        {"thorax": "Spine2", "left_elbow": "LeftForeArm"},
        22,
    ),
    "xsens": (
        f"Chest Chest2 Chest3 Chest4 Neck Head {MAX}",
        {"lower_back": "Chest", "upper_back": "Chest2", "thorax": "Chest4"}
        | {"lower_neck": "Neck", "left_wrist": "LeftWrist"},
        22,
    ),
    "unreal": (
        "root pelvis spine_01 spine_02 spine_03 neck_01 head "
        + sides(
            "thigh_* calf_* foot_* ball_* clavicle_* upperarm_* lowerarm_* hand_* thumb_01_*",
            "l",
            "r",
        ),
        {"root": "pelvis", "left_hip": "thigh_l", "right_ankle": "foot_r", "thorax": "spine_03"}
        | {"left_toes": "ball_l", "lower_neck": "neck_01", "right_elbow": "lowerarm_r"},
        22,
    ),
    "rigify": (
        " ".join(f"DEF-spine{tail}" for tail in ("", *(f".00{n}" for n in range(1, 7))))
        + " "
        + sides(
            "DEF-thigh.* DEF-shin.* DEF-foot.* DEF-toe.* DEF-shoulder.* DEF-upper_arm.* "
            "DEF-forearm.* DEF-hand.*",
            "L",
            "R",
        ),
        {"root": "DEF-spine", "head": "DEF-spine.006", "left_knee": "DEF-shin.L"}
        | {"left_clavicle": "DEF-shoulder.L", "right_shoulder": "DEF-upper_arm.R"},
        23,
    ),
}


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_convention_is_known(convention: str) -> None:
    names, expected, count = CONVENTIONS[convention]
    mapping = mapping_of(clip_named(names), {})
    assert expected.items() <= mapping.items()
    assert len(mapping) == count
    assert len(set(mapping.values())) == count
    for joint, bone in mapping.items():
        assert not (joint.startswith("left") and "ight" in bone)


def test_own_table_goes_before_the_guess() -> None:
    clip = clip_named(f"Hips Spine Spine1 Spine2 Neck Head {HUMANIK}")
    mapping = mapping_of(clip, {"lower_back": "Spine1", "upper_neck": "Neck"})
    assert mapping["lower_back"] == "Spine1"
    assert mapping["upper_neck"] == "Neck"
    assert mapping["left_hip"] == "LeftUpLeg"
    assert list(mapping) == [joint for joint in JOINTS if joint in mapping]


def test_strange_names_work_with_a_table_alone() -> None:
    table = {joint: f"bone{n}" for n, joint in enumerate(NEEDED)}
    assert mapping_of(clip_named(" ".join(table.values())), table) == table


def test_joints_of_the_table_that_are_not_there_are_all_told() -> None:
    clip = clip_named(f"Hips {HUMANIK}")
    with pytest.raises(SceneError) as caught:
        mapping_of(clip, {"left_hipp": "Hips", "left_knee": "LeftLge", "head": "Skull"})
    assert caught.value.problems == [
        "mapping: unknown joint 'left_hipp'; did you mean 'left_hip'?",
        "mapping: the clip has no joint 'LeftLge' for 'left_knee'; did you mean 'LeftLeg'?",
        "mapping: the clip has no joint 'Skull' for 'head'. Its joints are: "
        + ", ".join(clip.names)
        + ".",
    ]


def test_clip_without_legs_is_told_what_is_missing_and_what_it_has() -> None:
    clip = clip_named("Hips Spine LeftUpLeg LeftFoot RightUpLeg RightLeg RightFoot Tail")
    with pytest.raises(SceneError, match=r"known for left_knee\. .* Hips, Spine, .*, Tail\.$"):
        mapping_of(clip, {})
