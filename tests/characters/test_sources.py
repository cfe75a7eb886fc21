"""Rigged characters as they are read from glTF and USD."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from flowborne.base.colours import to_srgb
from flowborne.base.errors import SceneError
from flowborne.characters.model import MAX_COLOURS, few_colours
from flowborne.characters.rig import Z_UP
from flowborne.characters.source import Source, clip_number, read_source

from . import rigged

TURNED = 1e-3
"""Angle from the file that is accepted, degrees."""


@pytest.fixture(scope="module", params=["glb", "usda"])
def source(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Source:
    path = tmp_path_factory.mktemp("rigged") / f"box.{request.param}"
    (rigged.write_glb if request.param == "glb" else rigged.write_usd)(path)
    return read_source(path)


def test_joints_are_where_the_surface_is_bound_to_them(source: Source) -> None:
    assert source.rig.names == rigged.NAMES
    assert source.rig.parents.tolist() == list(rigged.PARENTS)
    assert_allclose(source.rig.position, rigged.PLACES @ Z_UP.T, atol=1e-6)
    assert_allclose(source.rig.rotation, Z_UP @ rigged.TURNS.as_matrix(), atol=1e-6)


def test_surface_is_in_metres_and_its_weights_sum_to_one(source: Source) -> None:
    vertices, faces, weights = rigged.box()
    surface = source.surface
    assert surface is not None
    assert_allclose(surface.vertices, vertices @ Z_UP.T, atol=1e-6)
    assert_allclose(surface.faces, faces)
    assert_allclose(surface.weights, weights / 0.8, atol=1e-6)


def test_surface_has_the_colour_of_the_file(source: Source) -> None:
    surface = source.surface
    assert surface is not None
    assert_allclose(surface.colours, np.tile(to_srgb(rigged.COLOUR), (len(surface.faces), 1)))


def test_a_texture_has_its_colour_on_each_face(tmp_path: Path) -> None:
    """Left faces are of the plain colour, right ones black, and each colour is a skin."""
    rigged.write_glb(tmp_path / "box.glb", texture=True)
    surface = read_source(tmp_path / "box.glb").surface
    assert surface is not None
    middle = surface.vertices[surface.faces][..., 0].mean(axis=1)
    plain, black = surface.colours[middle < -0.1], surface.colours[middle > 0.1]
    assert_allclose(plain, np.tile(to_srgb(rigged.COLOUR), (len(plain), 1)), atol=1e-6)
    assert_allclose(black, 0.0)
    few, which = few_colours(surface.colours)
    assert len(few) == 2
    assert_allclose(few[which], surface.colours, atol=0.5 / 255.0)
    many, which = few_colours(np.random.default_rng(1).random((500, 3)))
    assert len(many) <= MAX_COLOURS
    assert which.max() < len(many)


def test_clip_has_the_rotations_of_the_file(source: Source) -> None:
    times, turns, moved = rigged.clip()
    action = source.action(0)
    assert action.frame_time == pytest.approx(1.0 / rigged.RATE, rel=1e-6)
    assert len(action.position) == len(times)
    for name, wanted in turns.items():
        joint = rigged.NAMES.index(name)
        above = np.swapaxes(action.rotation[:, rigged.PARENTS[joint]], 1, 2)
        found = Rotation.from_matrix(above @ action.rotation[:, joint])
        assert np.degrees((found.inv() * wanted).magnitude()).max() < TURNED
    handle = action.position[:, 0]
    assert_allclose(action.position[:, 1] - handle, moved @ Z_UP.T, atol=1e-6)


def test_clips_of_one_name_are_told_apart(tmp_path: Path) -> None:
    rigged.write_glb(tmp_path / "box.glb", clips=3, called="Swim")
    source = read_source(tmp_path / "box.glb")
    assert source.clips == ("Swim", "Swim_2", "Swim_3")
    assert clip_number(source, "Swim_3", "box.glb") == 2


def test_what_is_wrong_with_a_file_is_one_message(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "cut.glb").write_bytes(b"glTF")
    (tmp_path / "cut.usda").write_text("none")
    for name, said in (
        ("cat.fbx", r"there is no file .*cat\.fbx\. Correct its name"),
        ("cat.xml", r"cat\.xml is a model, which needs no import.*under \[solids\]"),
        ("cat.max", r"cat\.max is none of \.glb, \.gltf, \.vrm, \.fbx, \.usd"),
        ("cat.glb", r"there is no file .*cat\.glb\. Correct its name"),
        ("cut.glb", r"cut\.glb cannot be read as glTF: it has no JSON chunk. Export it again"),
        ("cut.usda", r"cut\.usda cannot be read as USD"),
    ):
        with pytest.raises(SceneError, match=said):
            read_source(tmp_path / name)
    rigged.write_glb(tmp_path / "box.glb", clips=2)
    source = read_source(tmp_path / "box.glb")
    with pytest.raises(SceneError, match=r"has no clip 'Swin'\. It has: Swim 0, Swim 1\."):
        clip_number(source, "Swin", "box.glb")
    with pytest.raises(SceneError, match=r"2 clips\. Name one as the clip: Swim 0, Swim 1\."):
        clip_number(source, None, "box.glb")
    assert clip_number(source, "Swim 1", "box.glb") == 1
    rigged.write_glb(tmp_path / "still.glb", clips=0)
    with pytest.raises(SceneError, match=r"has no clip\. Name a file with clips"):
        clip_number(read_source(tmp_path / "still.glb"), None, "still.glb")
    monkeypatch.setitem(sys.modules, "pxr.Usd", None)
    with pytest.raises(SceneError, match=r"are read by .*flowborne\[usd\]"):
        read_source(tmp_path / "cut.usda")
