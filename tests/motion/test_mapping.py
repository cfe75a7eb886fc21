"""Which joint is which: limbs by the names of the tools in use, the trunk by its place."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.base.errors import SceneError
from flowborne.motion.clip import Clip
from flowborne.motion.human.skeleton import JOINTS
from flowborne.motion.mapping import REQUIRED, SIDED, families, mapping_of


def clip_of(
    trunk: str, neck: str, leg: str, arm: str, sides: tuple[str, str] = ("Left", "Right")
) -> Clip:
    """A person's joints with these names, each a chain; neck and arms hang on the trunk's last,
    legs on its first, and "*" stands for the side."""
    chains = [(-1, trunk.split())]
    chest = len(trunk.split()) - 1
    chains.append((chest, neck.split()))
    for part, above in ((leg, 0), (arm, chest)):
        chains += [(above, part.replace("*", side).split()) for side in sides]
    names: list[str] = []
    parents: list[int] = []
    for above, chain in chains:
        for n, name in enumerate(chain):
            parents.append(above if n == 0 else len(names) - 1)
            names.append(name)
    return clip_with(tuple(names), parents)


def clip_with(names: tuple[str, ...], parents: list[int]) -> Clip:
    count = len(names)
    still = np.tile([1.0, 0.0, 0.0, 0.0], (1, count, 1))
    return Clip(names, np.array(parents), np.zeros((count, 3)), {}, 0.01, still, np.zeros((1, 3)))


MAX = ("*HipJoint *Hip *Knee *Ankle *Toe", "*Collar *Shoulder *Elbow *Wrist")
HUMANIK = ("*UpLeg *Leg *Foot *ToeBase", "*Shoulder *Arm *ForeArm *Hand *HandIndex1")
LETTERS = ("L", "R")

FAMILIES = {
    "cmu for max": (
        (
            "Hips lowerback Chest Chest2",
            "lowerneck Neck Head",
            "*HipJoint LeftHip LeftKnee LeftAnkle LeftToe",
            "LeftCollar LeftShoulder LeftElbow LeftWrist lhand LThumb",
        ),
        23,
        {"lower_back": "lowerback", "upper_back": "Chest", "thorax": "Chest2"}
        | {"lower_neck": "lowerneck", "left_clavicle": "LeftCollar", "left_wrist": "lhand"}
        | {"left_hip": "LeftHip"},
    ),
    "cmu for motionbuilder": (
        ("Hips LowerBack Spine Spine1", "Neck Neck1 Head", *HUMANIK),
        23,
        {"lower_back": "LowerBack", "upper_back": "Spine", "upper_neck": "Neck1"}
        | {"left_hip": "LeftUpLeg", "left_clavicle": "LeftShoulder", "right_wrist": "RightHand"},
    ),
    "asf": (
        (
            "root lowerback upperback thorax",
            "lowerneck upperneck head",
            "*hipjoint *femur *tibia *foot *toes",
            "*clavicle *humerus *radius *wrist *hand",
            ("l", "r"),
        ),
        23,
        {"left_hip": "lfemur", "right_knee": "rtibia", "left_elbow": "lradius"}
        | {"left_wrist": "lhand", "thorax": "thorax", "root": "root"},
    ),
    "mixamo": (
        (
            "mixamorig:Hips mixamorig:Spine mixamorig:Spine1 mixamorig:Spine2",
            "mixamorig:Neck mixamorig:Head mixamorig:HeadTop_End",
            *(chain.replace("*", "mixamorig:*") for chain in HUMANIK),
        ),
        22,
        {"root": "mixamorig:Hips", "thorax": "mixamorig:Spine2", "lower_neck": "mixamorig:Neck"}
        | {"left_knee": "mixamorig:LeftLeg", "left_toes": "mixamorig:LeftToeBase"},
    ),
    "xsens": (
        ("Hips Chest Chest2 Chest3 Chest4", "Neck Head", *MAX),
        22,
        {"lower_back": "Chest", "upper_back": "Chest2", "thorax": "Chest4"}
        | {"lower_neck": "Neck", "left_wrist": "LeftWrist"},
    ),
    "one chest of four": (
        ("Hips Chest", "Neck Head", *MAX),
        20,
        {"lower_back": "Chest", "lower_neck": "Neck", "head": "Head"},
    ),
    "biovision": (
        ("Hips Chest", "Neck Head", "*UpLeg *LowLeg *Foot", "*Collar *UpArm *LowArm *Hand"),
        18,
        {"left_knee": "LeftLowLeg", "right_elbow": "RightLowArm", "left_clavicle": "LeftCollar"},
    ),
    "smpl": (
        (
            "m_avg_Pelvis m_avg_Spine1 m_avg_Spine2 m_avg_Spine3",
            "m_avg_Neck m_avg_Head",
            "m_avg_*_Hip m_avg_*_Knee m_avg_*_Ankle m_avg_*_Foot",
            "m_avg_*_Collar m_avg_*_Shoulder m_avg_*_Elbow m_avg_*_Wrist m_avg_*_Hand",
            LETTERS,
        ),
        22,
        {"left_toes": "m_avg_L_Foot", "left_wrist": "m_avg_L_Wrist", "root": "m_avg_Pelvis"},
    ),
    "unity and vrm": (
        (
            "J_Bip_C_Hips J_Bip_C_Spine J_Bip_C_Chest J_Bip_C_UpperChest",
            "J_Bip_C_Neck J_Bip_C_Head",
            "J_Bip_*_UpperLeg J_Bip_*_LowerLeg J_Bip_*_Foot J_Bip_*_ToeBase",
            "J_Bip_*_Shoulder J_Bip_*_UpperArm J_Bip_*_LowerArm J_Bip_*_Hand",
            LETTERS,
        ),
        22,
        {"thorax": "J_Bip_C_UpperChest", "right_shoulder": "J_Bip_R_UpperArm"},
    ),
    "bandai namco": (
        (
            "Hips Spine Chest",
            "Neck Head",
            "UpperLeg_* LowerLeg_* Foot_* Toes_*",
            "Shoulder_* UpperArm_* LowerArm_* Hand_*",
            LETTERS,
        ),
        21,
        {"lower_back": "Spine", "thorax": "Chest", "left_clavicle": "Shoulder_L"},
    ),
    "xsens' segments": (
        (
            "Pelvis L5 L3 T12 T8",
            "Neck Head",
            "*UpperLeg *LowerLeg *Foot *Toe",
            "*Shoulder *UpperArm *ForeArm *Hand",
        ),
        22,
        {"lower_back": "L5", "upper_back": "L3", "thorax": "T8", "left_elbow": "LeftForeArm"},
    ),
    "rokoko": (
        (
            "Hips Spine1 Spine2 Spine3 Spine4",
            "Neck Head",
            "*Thigh *Shin *Foot *Toe",
            "*Shoulder *Arm *ForeArm *Hand",
        ),
        22,
        {"left_hip": "LeftThigh", "left_shoulder": "LeftArm", "thorax": "Spine4"},
    ),
    "poser": (
        (
            "hip abdomen chest",
            "neck head",
            "*Buttock *Thigh *Shin *Foot *Toe",
            "*Collar *Shldr *ForeArm *Hand *Thumb1",
            ("l", "r"),
        ),
        21,
        {"root": "hip", "left_hip": "lThigh", "right_shoulder": "rShldr"},
    ),
    "daz": (
        (
            "hip abdomenLower abdomenUpper chestLower chestUpper",
            "neckLower neckUpper head",
            "*ThighBend *ThighTwist *Shin *Foot *Toe",
            "*Collar *ShldrBend *ShldrTwist *ForearmBend *ForearmTwist *Hand",
            ("l", "r"),
        ),
        23,
        {"left_hip": "lThighBend", "left_elbow": "lForearmBend", "upper_neck": "neckUpper"},
    ),
    "unreal": (
        (
            "pelvis spine_01 spine_02 spine_03",
            "neck_01 head",
            "thigh_* calf_* foot_* ball_*",
            "clavicle_* upperarm_* lowerarm_* hand_* thumb_01_*",
            ("l", "r"),
        ),
        22,
        {"root": "pelvis", "left_hip": "thigh_l", "right_ankle": "foot_r", "thorax": "spine_03"}
        | {"left_toes": "ball_l", "lower_neck": "neck_01", "right_elbow": "lowerarm_r"},
    ),
    "biped": (
        (
            "Bip01_Pelvis Bip01_Spine Bip01_Spine1 Bip01_Spine2",
            "Bip01_Neck Bip01_Head",
            "Bip01_*_Thigh Bip01_*_Calf Bip01_*_Foot Bip01_*_Toe0",
            "Bip01_*_Clavicle Bip01_*_UpperArm Bip01_*_Forearm Bip01_*_Hand Bip01_*_Finger0",
            LETTERS,
        ),
        22,
        {"left_toes": "Bip01_L_Toe0", "right_elbow": "Bip01_R_Forearm"},
    ),
    "makehuman": (
        (
            "root spine05 spine04 spine03 spine02 spine01",
            "neck01 neck02 neck03 head",
            "pelvis.* upperleg01.* upperleg02.* lowerleg01.* lowerleg02.* foot.* toe1-1.*",
            "clavicle.* shoulder01.* upperarm01.* upperarm02.* lowerarm01.* lowerarm02.* wrist.*",
            LETTERS,
        ),
        23,
        {"lower_back": "spine05", "thorax": "spine01", "left_knee": "lowerleg01.L"}
        | {"left_shoulder": "upperarm01.L", "left_toes": "toe1-1.L", "upper_neck": "neck02"},
    ),
    "rigify": (
        (
            "DEF-spine DEF-spine.001 DEF-spine.002 DEF-spine.003",
            "DEF-spine.004 DEF-spine.005 DEF-head",
            "DEF-thigh.* DEF-shin.* DEF-foot.* DEF-toe.*",
            "DEF-shoulder.* DEF-upper_arm.* DEF-forearm.* DEF-hand.*",
            LETTERS,
        ),
        23,
        {"root": "DEF-spine", "left_knee": "DEF-shin.L", "right_shoulder": "DEF-upper_arm.R"},
    ),
    "motive": (
        (
            "Hip Ab Chest",
            "Neck Head",
            "*Thigh *Shin *Foot *Toe",
            "*Shoulder *UArm *FArm *Hand",
            LETTERS,
        ),
        21,
        {"left_shoulder": "LUArm", "left_elbow": "LFArm"},
    ),
    "all in small letters": (
        (
            "hips spine chest",
            "neck head",
            "*upleg *leg *foot *toe",
            "*shoulder *arm *forearm *hand",
            ("left", "right"),
        ),
        21,
        {"left_hip": "leftupleg", "right_clavicle": "rightshoulder"},
    ),
    "a joint's own ending": (
        (
            "hips_JNT spine_JNT spine1_JNT spine2_JNT",
            "neck_JNT head_JNT",
            "*_upleg_JNT *_leg_JNT *_foot_JNT *_toebase_JNT",
            "*_shoulder_JNT *_arm_JNT *_forearm_JNT *_hand_JNT",
            ("l", "r"),
        ),
        22,
        {"left_hip": "l_upleg_JNT", "head": "head_JNT"},
    ),
    "flowborne's bodies": (
        (
            "pelvis lower_back upper_back thorax",
            "lower_neck upper_neck head",
            "*_thigh *_shank *_foot *_toes",
            "*_clavicle *_upper_arm *_forearm *_hand",
            ("left", "right"),
        ),
        23,
        {"left_hip": "left_thigh", "thorax": "thorax"},
    ),
}
"""Chains, how many joints are found, and some of them."""


@pytest.mark.parametrize("family", FAMILIES)
def test_family_is_known(family: str) -> None:
    chains, count, expected = FAMILIES[family]
    clip = clip_of(*chains)
    if family == "cmu for max":
        names = tuple(
            name.replace("Left", "Right").replace("lhand", "rhand").replace("LThumb", "RThumb")
            if clip.names.index(name) != n
            else name
            for n, name in enumerate(clip.names)
        )
        clip = clip_with(names, clip.parents.tolist())
    mapping = mapping_of(clip, {})
    assert expected.items() <= mapping.items()
    assert len(mapping) == count
    assert len(set(mapping.values())) == count
    for joint, bone in mapping.items():
        assert not (joint.startswith("left") and "ight" in bone)


def test_every_family_has_its_source_and_a_name_for_every_joint() -> None:
    assert len(families()) >= 12
    for family in families():
        assert family.name
        assert family.source
        assert set(family.names) == set(SIDED)
        assert all(family.names.values())


PERSON = clip_of("Hips Spine Spine1 Spine2", "Neck Head", *HUMANIK)


def test_own_table_goes_before_the_guess() -> None:
    mapping = mapping_of(PERSON, {"lower_back": "Spine1", "upper_neck": "Neck"})
    assert mapping["lower_back"] == "Spine1"
    assert mapping["upper_neck"] == "Neck"
    assert mapping["left_hip"] == "LeftUpLeg"
    assert not {"upper_back", "thorax", "lower_neck"} & set(mapping)


def test_strange_names_work_with_a_table_alone() -> None:
    names = tuple(f"bone{n}" for n in range(len(PERSON.names)))
    strange = clip_with(names, PERSON.parents.tolist())
    known = mapping_of(PERSON, {})
    table = {joint: names[PERSON.names.index(known[joint])] for joint in REQUIRED}
    mapping = mapping_of(strange, table)
    assert table.items() <= mapping.items()
    assert mapping["thorax"] == names[PERSON.names.index("Spine2")], "by its place"


def test_joints_of_the_table_that_are_not_there_are_all_told() -> None:
    with pytest.raises(SceneError) as caught:
        mapping_of(PERSON, {"left_hipp": "Hips", "left_knee": "LeftLge", "head": "Skull"})
    assert caught.value.problems == [
        "mapping: unknown joint 'left_hipp'; did you mean 'left_hip'?",
        "mapping: the clip has no joint 'LeftLge' for 'left_knee'; did you mean 'LeftLeg'?",
        "mapping: the clip has no joint 'Skull' for 'head'. Its joints are: "
        + ", ".join(PERSON.names)
        + ".",
    ]


def test_missing_limbs_are_told_with_the_names_that_were_looked_for() -> None:
    clip = clip_of("Hips Spine", "Neck Head", "*UpLeg *Foot", "*Shoulder *Arm *Hand")
    with pytest.raises(SceneError) as caught:
        mapping_of(clip, {})
    (problem,) = caught.value.problems
    assert "no joint of the clip is known for left_knee, left_elbow, right_knee" in problem
    assert "looked for: knee, " in problem
    assert "forearm" in problem
    assert "each with left, right, l or r). Name them in [clip.mapping]. The clip's" in problem
    assert problem.endswith("RightHand.")


def test_a_table_against_the_tree_is_refused() -> None:
    with pytest.raises(SceneError, match=r"'LeftUpLeg' for left_knee is not below 'LeftLeg'"):
        mapping_of(PERSON, {"left_hip": "LeftLeg", "left_knee": "LeftUpLeg"})


def test_the_order_of_joints_is_the_humans() -> None:
    mapping = mapping_of(PERSON, {})
    assert list(mapping) == [joint for joint in JOINTS if joint in mapping]
