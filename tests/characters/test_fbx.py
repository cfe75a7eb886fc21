"""Characters of .fbx files: box.fbx is the rigged box after Blender (box_fbx.py made it)."""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial import KDTree

import flowborne as fb
from flowborne.base import extras
from flowborne.base.errors import SceneError
from flowborne.characters import apart
from flowborne.characters.source import Source, read_source
from flowborne.scenes.bodies import load_model

from ..read_bvh import read_bvh
from . import rigged

BOX = Path(__file__).with_name("box.fbx")

FAR = 2e-5
"""Distance that is accepted, m: Blender's own glTF of the box is as far from the original."""

TURNED = 1e-5
"""Difference that is accepted between entries of rotation matrices, 6e-4 degrees."""


@pytest.fixture(scope="module")
def sources(tmp_path_factory: pytest.TempPathFactory) -> tuple[Source, Source]:
    """The box as .fbx and as .glb."""
    path = tmp_path_factory.mktemp("fbx") / "box.glb"
    rigged.write_glb(path)
    return read_source(BOX), read_source(path)


def test_joints_are_those_of_the_gltf(sources: tuple[Source, Source]) -> None:
    fbx, glb = (source.rig for source in sources)
    assert fbx.names == glb.names
    assert fbx.parents.tolist() == glb.parents.tolist()
    assert_allclose(fbx.position, glb.position, atol=FAR)
    assert_allclose(fbx.rotation, glb.rotation, atol=TURNED)


def test_surface_has_the_size_weights_and_colour_of_the_gltf(
    sources: tuple[Source, Source],
) -> None:
    """FBX counts in centimetres, and has a vertex for each normal at an edge of the box."""
    fbx, glb = (source.surface for source in sources)
    assert fbx is not None
    assert glb is not None
    far, same = KDTree(glb.vertices).query(fbx.vertices)
    assert far.max() < FAR
    assert set(same) == set(range(len(glb.vertices)))
    assert_allclose(fbx.weights, glb.weights[same], atol=1e-6)
    assert sorted(map(sorted, same[fbx.faces].tolist())) == sorted(map(sorted, glb.faces.tolist()))
    assert_allclose(fbx.colours, glb.colours, atol=1e-3)


def test_clip_has_the_poses_of_the_gltf(sources: tuple[Source, Source]) -> None:
    assert sources[0].clips == ("Armature|Swim 0",)
    fbx, glb = (source.action(0) for source in sources)
    assert fbx.frame_time == pytest.approx(glb.frame_time, rel=1e-6)
    assert_allclose(fbx.position, glb.position, atol=FAR)
    assert_allclose(fbx.rotation, glb.rotation, atol=TURNED)


def test_bodies_and_motion_are_those_of_the_gltf(tmp_path: Path) -> None:
    rigged.write_glb(tmp_path / "box.glb")
    scenes = [
        fb.import_character(file, tmp_path / file.suffix[1:]).scene
        for file in (BOX, tmp_path / "box.glb")
    ]
    fbx, glb = (load_model(fb.load_scene(scene)) for scene in scenes)
    assert fbx.body_names == glb.body_names
    assert fbx.joint_names == glb.joint_names
    assert_allclose(fbx.body_mass, glb.body_mass, rtol=FAR)
    assert_allclose(fbx.mj.body_pos, glb.mj.body_pos, atol=FAR)
    assert_allclose(fbx.mj.body_inertia, glb.mj.body_inertia, rtol=1e-4)
    moved, wanted = (read_bvh(scene.with_suffix(".bvh")) for scene in scenes)
    assert moved.names == wanted.names
    assert moved.frames == wanted.frames
    for ours, theirs in zip(moved.poses(), wanted.poses(), strict=True):
        assert_allclose(ours, theirs, atol=FAR)


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (lambda whole: b"", "FBX-Parser unexpected end of file. Export it again."),
        (lambda whole: b"hello", "FBX-Parser unexpected end of file. Export it again."),
        (lambda whole: whole[: len(whole) // 2], "block offset is out of range. Export it again."),
    ],
)
def test_a_damaged_file_is_refused_with_the_reason(
    damage: Callable[[bytes], bytes], said: str, tmp_path: Path
) -> None:
    (tmp_path / "cat.fbx").write_bytes(damage(BOX.read_bytes()))
    with pytest.raises(SceneError) as caught:
        fb.import_character(tmp_path / "cat.fbx", tmp_path / "out")
    assert str(caught.value).startswith("cat.fbx cannot be read as FBX: FBX-")
    assert str(caught.value).endswith(said)
    assert not (tmp_path / "out").exists()


def test_random_damage_ends_in_a_message_or_a_character(tmp_path: Path) -> None:
    rng = np.random.default_rng(67)
    said = []
    for number in range(6):
        content = bytearray(BOX.read_bytes())
        for at in rng.integers(0, len(content), 1 + 3 * number):
            content[at] = rng.integers(256)
        (tmp_path / "box.fbx").write_bytes(content)
        try:
            assert len(read_source(tmp_path / "box.fbx").rig.names) <= len(rigged.NAMES)
        except SceneError as error:
            said.append(str(error))
    assert len(said) > 1
    assert all(message.startswith("box.fbx") for message in said)


def test_a_reader_that_crashes_or_hangs_is_one_message(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    reader = tmp_path / "reader"
    reader.write_text("#!/bin/sh\nkill -SEGV $$\n")
    reader.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(reader))
    with pytest.raises(SceneError, match=r"box\.fbx cannot be read as FBX: reading it crashes"):
        read_source(BOX)
    reader.write_text("#!/bin/sh\nexec sleep 60\n")
    monkeypatch.setattr(apart, "MAX_SECONDS", 0.2)
    with pytest.raises(SceneError, match=r"box\.fbx cannot be read as FBX within 0\.2 s"):
        read_source(BOX)


def test_a_file_that_is_too_large_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(apart, "MAX_FILE_BYTES", 60_000)
    with pytest.raises(SceneError, match=r"box\.fbx has 5\.\d+e-05 GB; the maximum is"):
        read_source(BOX)


def test_without_assimp_the_message_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    def gone(name: str) -> None:
        raise PackageNotFoundError(name)

    monkeypatch.setattr(extras, "distribution", gone)
    with pytest.raises(SceneError, match=r"read by cmeel-assimp .*pip install 'flowborne\[fbx\]'"):
        read_source(BOX)
