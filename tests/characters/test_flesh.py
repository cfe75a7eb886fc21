"""Flesh on a character: cores inside the surface of its pieces, held by the bodies next to it."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
import tomli_w
import trimesh

import flowborne as fb
from flowborne.scenes.bodies import bones_of, load_model
from flowborne.scenes.flesh import meshed, staleness
from flowborne.solids.skins import skins_of

from . import rigged


@pytest.fixture(scope="module")
def box(tmp_path_factory: pytest.TempPathFactory) -> fb.Scene:
    """The scene of the rigged box with a tail of flesh."""
    folder = tmp_path_factory.mktemp("box")
    rigged.write_glb(folder / "box.glb")
    made = fb.import_character(folder / "box.glb", folder / "scene", density=900.0, flesh=["tail"])
    return fb.load_scene(made.scene)


def test_flesh_fills_the_piece_of_its_joint(box: fb.Scene) -> None:
    """Its mass is that of its surface, which has a dome in the trunk."""
    surface = trimesh.load_mesh(box.folder / "box-meshes" / "flesh.obj")
    piece = rigged.WIDTH * rigged.HEIGHT * (rigged.LENGTH - rigged.JOINT)
    assert piece < surface.volume < 1.15 * piece
    model = load_model(box)
    trunk = rigged.WIDTH * rigged.HEIGHT * rigged.JOINT
    mass = 900.0 * (trunk + surface.volume)
    assert model.body_mass.sum() == pytest.approx(mass, rel=0.02)
    assert model.geom_covered.tolist() == [False, True]


def test_the_body_next_to_it_holds_what_is_inside_it(box: fb.Scene) -> None:
    (table,) = box.flesh
    assert (table.bones, table.neighbours) == (("tail",), ("handle",))
    mesh, _ = meshed(bones_of(box), table, box.folder)
    holders = np.array(mesh.holders)
    along = mesh.points[:, 1]  # the nose is at 0
    assert (along[holders == "handle"] < rigged.JOINT + 0.02).all()
    assert (along[holders == "tail"] > rigged.JOINT).all()
    assert {*np.unique(holders)} == {"", "handle", "tail"}


def test_the_import_leaves_a_mesh_that_a_run_uses(box: fb.Scene) -> None:
    (table,) = box.flesh
    assert table.mesh is not None
    assert (box.folder / table.mesh).exists()
    assert staleness(bones_of(box), table, box.folder) is None
    moved = table.model_copy(update={"neighbours": ()})
    assert "shapes of the bones" in (staleness(bones_of(box), moved, box.folder) or "")


def test_the_skin_ends_where_flesh_begins(box: fb.Scene) -> None:
    (skin,) = skins_of(load_model(box).mj)
    assert 0.5 < skin.vertices[skin.faces][..., 1].max() < rigged.JOINT + 0.11


def test_flesh_moves_with_the_clip(box: fb.Scene, tmp_path: Path) -> None:
    """Stiff flesh is near its bone, some of it in the trunk, after frames of the clip."""
    tables = tomllib.loads((box.folder / "box.toml").read_text())
    for table in ("domain", "fluid", "boundaries", "initial", "output"):
        tables.pop(table)
    tables["time"] |= {"frames": 3, "steps_per_frame": 8}
    tables["clip"]["free"], tables["flesh"][0]["young"] = [], 1e6
    path = box.folder / "dry.toml"
    path.write_text(tomli_w.dumps(tables))
    result = fb.run(fb.load_scene(path), tmp_path / "run", film=False)
    run = fb.open_run(result.folder)
    first, last = run.state(0), run.state(3)
    body = run.bodies.index("tail")

    def local(state: dict[str, np.ndarray]) -> np.ndarray:
        away = state["flesh_vertices"] - state["body_position"][body]
        return np.asarray(away @ state["body_rotation"][body])

    moved = np.linalg.norm(local(last) - local(first), axis=1)
    assert np.median(moved) < 0.02
    assert np.linalg.norm(last["flesh_vertices"] - first["flesh_vertices"], axis=1).max() > 0.1


def test_joints_that_cannot_be_flesh_are_named(tmp_path: Path) -> None:
    rigged.write_glb(tmp_path / "box.glb")
    for joint, why in (("tail_tip", "has too little of the mesh"), ("fin", "is not there")):
        said = rf"joint '{joint}' cannot be flesh, because it {why}\. Name some of handle, tail\."
        with pytest.raises(fb.SceneError, match=said):
            fb.import_character(tmp_path / "box.glb", tmp_path / "out", flesh=["tail", joint])


def test_a_bone_outside_of_its_mesh_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    above = [[0.0, 0.0, 0.0]] * 2 + [[0.0, 1.0, 0.0]] * 2
    monkeypatch.setattr(rigged, "PLACES", rigged.PLACES + above)
    rigged.write_glb(tmp_path / "box.glb")
    with pytest.raises(fb.SceneError, match="bone 'tail' lies outside of its part of the mesh"):
        fb.import_character(tmp_path / "box.glb", tmp_path / "out", flesh=["tail"])
    with pytest.raises(fb.SceneError, match="flesh is 'tail'; give names of joints"):
        fb.import_character(tmp_path / "box.glb", tmp_path / "out", flesh="tail")
