"""Clips by others and generated ones: with its file alone a walker is where that has it."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from flowborne.scenes.build import build
from flowborne.scenes.capture import capture_of
from flowborne.scenes.load import check_scene, load_scene
from flowborne.scenes.notes import notes_of

from .rigs import UP, Way, rig
from .walkers import CONTROL, worst

CLIPS = Path(__file__).parent / "clips"
OTHERS = Path(__file__).parents[3] / "shared" / "mocap" / "others"

READ = {
    "mixamo-freebvh.bvh": (0.01, "y", ("upper_neck",)),
    "pybvh-test2.bvh": (0.01, "y", ("upper_neck",)),
    "pybvh-test3.bvh": (0.0254, "z", ()),
    "rokoko-jesse.bvh": (0.01, "y", ("upper_neck",)),
    "fair1-zombie.bvh": (0.0395, "z", ("upper_neck",)),
}
"""File -> unit and axis that is up, as found, and joints that it lacks."""

PLACE, TURN, BEND = 0.003, 0.5, 90.0
"""m, and degrees: the most by which a joint is off, and by which a body is bent from its rest."""


@pytest.mark.parametrize("name", READ)
def test_a_walker_is_where_its_file_has_it(name: str, tmp_path: Path) -> None:
    path = Path(shutil.copy(CLIPS / name, tmp_path))
    off = worst(path, range(0, 16, 3))
    assert off.place < PLACE
    assert off.turn < TURN
    assert off.bend[0] < BEND, off.bend[1]
    assert off.joints >= 22
    scene = load_scene(path.with_suffix(".toml"))
    capture = capture_of(scene)
    assert capture is not None
    assert (capture.unit, capture.up, capture.held) == READ[name]
    model = build(scene).world.setup.solid
    assert not set(capture.held) & set(model.joint_names), "what the file lacks is welded"
    notes = list(notes_of(scene, model))
    assert any(f"read with unit = {capture.unit:g}" in note for note in notes)
    assert any("held: upper_neck" in note for note in notes) == bool(capture.held)
    assert any("thorax_base turns as" in note for note in notes) == bool(capture.links)
    assert model.body_mass.sum() == pytest.approx(73.0)


@pytest.mark.parametrize("name", ["mixamo-freebvh.bvh", "pybvh-test3.bvh"])
def test_a_controlled_back_leaves_the_legs_where_they_are(name: str, tmp_path: Path) -> None:
    path = Path(shutil.copy(CLIPS / name, tmp_path))
    off = worst(path, (0, 2), ["lower_back"], CONTROL)
    assert off.place < PLACE
    assert off.turn < TURN
    assert off.joints == 9


@pytest.mark.skipif(not OTHERS.is_dir(), reason="the whole clips are not here")
@pytest.mark.parametrize("name", READ)
def test_scenes_with_walkers_take_the_whole_clips(name: str) -> None:
    """All joints above the hips controlled in one, those that the file lacks among them."""
    for scene in ("human-gravity-arms", "human-wind-all"):
        assert check_scene(scene, {"clip.file": str(OTHERS / name)}) == []


RIGS = {
    "Unity": "Hips Spine Chest; Neck Head;"
    " *UpperLeg *LowerLeg *Foot *Toes; *Shoulder *UpperArm *LowerArm *Hand;"
    " Left Right",
    "VRM": "J_Bip_C_Hips J_Bip_C_Spine J_Bip_C_Chest J_Bip_C_UpperChest; J_Bip_C_Neck J_Bip_C_Head;"
    " J_Bip_*_UpperLeg J_Bip_*_LowerLeg J_Bip_*_Foot;"
    " J_Bip_*_Shoulder J_Bip_*_UpperArm J_Bip_*_LowerArm J_Bip_*_Hand;"
    " L R",
    "Biovision": "Hips Chest; Neck Head;"
    " *UpLeg *LowLeg *Foot; *Collar *UpArm *LowArm *Hand;"
    " Left Right",
    "Poser": "hip abdomen chest; neck head;"
    " |*Buttock *Thigh *Shin *Foot *Toe; *Collar *Shldr *ForeArm *Hand;"
    " l r",
    "DAZ": "hip abdomenLower abdomenUpper chestLower chestUpper; neckLower neckUpper head;"
    " *ThighBend |*ThighTwist *Shin *Foot *Toe;"
    " *Collar *ShldrBend |*ShldrTwist *ForearmBend |*ForearmTwist *Hand;"
    " l r",
    "MakeHuman": "root spine05 spine04 spine03 spine02 spine01; neck01 neck02 neck03 head;"
    " |pelvis.* upperleg01.* |upperleg02.* lowerleg01.* |lowerleg02.* foot.*;"
    " clavicle.* |shoulder01.* upperarm01.* |upperarm02.* lowerarm01.* wrist.*;"
    " L R",
    "Biped": "Bip01_Pelvis Bip01_Spine Bip01_Spine1; Bip01_Neck Bip01_Head;"
    " Bip01_*_Thigh Bip01_*_Calf Bip01_*_Foot Bip01_*_Toe0;"
    " Bip01_*_Clavicle Bip01_*_UpperArm Bip01_*_Forearm Bip01_*_Hand;"
    " L R",
    "Xsens' segments": "Pelvis L5 L3 T12 T8; Neck Head;"
    " *UpperLeg *LowerLeg *Foot *Toe; *Shoulder *UpperArm *ForeArm *Hand;"
    " Left Right",
    "Rokoko": "Hips Spine1 Spine2 Spine3 Spine4; Neck Head;"
    " *Thigh *Shin *Foot *Toe; *Shoulder *Arm *ForeArm *Hand;"
    " Left Right",
    "Perception Neuron": "Hips Spine Spine1 Spine2; Neck Neck1 Head;"
    " *UpLeg *Leg *Foot *ToeBase; *Shoulder *Arm *ForeArm *Hand;"
    " Left Right",
    "Unreal": "pelvis spine_01 spine_02 spine_03 spine_04 spine_05; neck_01 neck_02 head;"
    " thigh_* calf_* foot_* ball_*; clavicle_* upperarm_* lowerarm_* hand_*;"
    " l r",
    "SMPL": "Pelvis Spine1 Spine2 Spine3; Neck Head;"
    " *_Hip *_Knee *_Ankle *_Foot; *_Collar *_Shoulder *_Elbow *_Wrist;"
    " L R",
}
"""Trunk, neck, leg, arm and words for the sides of twelve families; "|" stands before a joint that
the human does not have."""

WAYS = st.builds(
    Way,
    up=st.sampled_from(sorted(UP)),
    unit=st.sampled_from([0.001, 0.01, 0.0254, 0.056444, 0.3048, 1.0, 0.17]),
    turned=st.booleans(),
    whole=st.booleans(),
    reference=st.booleans(),
    seed=st.integers(0, 2**32),
)


@pytest.mark.parametrize("family", RIGS)
@settings(
    max_examples=1, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(way=WAYS)
def test_a_generated_rig_walks_as_its_file_says(family: str, tmp_path: Path, way: Way) -> None:
    """Of any order of angles, axis, unit and pose of zeros, with a root above the hips or none."""
    path = tmp_path / "rig.bvh"
    *chains, sides = RIGS[family].split(";")
    path.write_text(rig(*chains, sides.split(), way))
    off = worst(path, (0, 3))
    assert off.place < PLACE
    assert off.turn < TURN
    assert off.bend[0] < BEND, off.bend[1]
    capture = capture_of(load_scene(path.with_suffix(".toml")))
    assert capture is not None
    assert capture.up == way.up
    assert capture.unit == way.unit or way.unit == 0.17
