"""Binary glTF, read back by pygltflib and trimesh, and skinned as glTF's specification says."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import trimesh
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

import flowborne as fb
from flowborne.formats.creature import Creature
from flowborne.formats.glb import ExporterGlb
from flowborne.view.open_run import OpenRun

read_back = pytest.importorskip("read_back", exc_type=ImportError)

FAR = 1e-5
"""Distance from the run that is accepted, in sizes of the creature."""

TURNED = 1e-3
"""Angle from the run that is accepted, degrees."""

RUNS = ["chain", "fish", "walk"]


@pytest.fixture(scope="module")
def files(
    tmp_path_factory: pytest.TempPathFactory, chain: Path, fish: Path, walk: Path
) -> dict[str, tuple[Creature, Path]]:
    """Name -> creature of the run, and its file."""
    folder, made = tmp_path_factory.mktemp("glb"), {}
    for run in (chain, fish, walk):
        fb.export(run, folder / f"{run.name}.glb")
        made[run.name] = (Creature(fb.open_run(run)), folder / f"{run.name}.glb")
    return made


Files = dict[str, tuple[Creature, Path]]


VALIDATOR = """
const validator = require("gltf-validator");
const bytes = new Uint8Array(require("fs").readFileSync(process.argv[1]));
validator.validateBytes(bytes).then((report) => console.log(JSON.stringify(report.issues)));
"""


@pytest.mark.parametrize("name", RUNS)
def test_khronos_validator_finds_nothing(name: str, files: Files) -> None:
    """`make gltf-validator` installs it, by npm."""
    modules = Path(__file__).parents[2] / "build" / "node_modules"
    if shutil.which("node") is None or not (modules / "gltf-validator").is_dir():
        pytest.skip("the glTF validator is not installed")
    done = subprocess.run(
        ["node", "-e", VALIDATOR, str(files[name][1])],
        env={**os.environ, "NODE_PATH": str(modules)},
        capture_output=True,
        check=True,
    )
    issues = json.loads(done.stdout)
    assert issues["messages"] == []
    assert issues["numErrors"] == issues["numWarnings"] == 0


@pytest.mark.parametrize("name", RUNS)
def test_every_mesh_is_where_the_run_has_it(name: str, files: Files) -> None:
    creature, path = files[name]
    read, model = read_back.Gltf(path), creature.model
    skins = {skin.name for skin in creature.skins}
    for node in read.gltf.nodes:
        if node.mesh is not None and node.name not in skins:
            part = read.gltf.meshes[node.mesh].primitives[0]
            faces = model.geom_shape[model.geom_names.index(node.name)].triangles()[1]
            assert_array_equal(read.array(part.indices).ravel(), np.ravel(faces))
    for frame in range(len(creature.run)):
        found, wanted = read.meshes(frame), read_back.meshes_of(creature, frame)
        assert set(found) == set(wanted)
        for part, points in found.items():
            assert_allclose(points, wanted[part], atol=FAR * creature.size)


@pytest.mark.parametrize("name", RUNS)
def test_joints_turn_as_in_the_run_at_its_rate(name: str, files: Files) -> None:
    creature, path = files[name]
    read, skeleton = read_back.Gltf(path), creature.skeleton
    wanted = np.arange(len(creature.run)) / creature.run.frames_per_second
    assert_allclose(read.times, wanted, rtol=1e-6)
    for frame in range(len(creature.run)):
        joints = read.joints(frame)
        assert list(joints) == list(skeleton.names)
        found = np.array(list(joints.values()))
        away = np.einsum("nji,njk->nik", found[:, :3, :3], skeleton.rotation[frame])
        assert np.degrees(Rotation.from_matrix(away).magnitude()).max() < TURNED
        assert_allclose(found[:, :3, 3], skeleton.position[frame], atol=FAR * creature.size)


def test_flesh_says_how_near_it_is(files: Files, fish: Path, tmp_path: Path) -> None:
    """Without targets the error that is stated is the one that is found."""
    creature, path = files["fish"]
    written = ExporterGlb(targets=0).write(OpenRun(fish), tmp_path / "bare.glb")
    read, (skin,) = read_back.Gltf(tmp_path / "bare.glb"), creature.skins
    found = [
        read.meshes(frame)["skin"] - creature.run.state(frame)["flesh_vertices"][skin.chosen]
        for frame in range(len(creature.run))
    ]
    (mesh,) = (node.mesh for node in read.gltf.nodes if node.name == "skin" and node.mesh)
    stated = read.gltf.meshes[mesh].extras["error_m"]
    assert np.linalg.norm(found, axis=2).max() == pytest.approx(stated, rel=1e-3)
    assert stated > FAR * creature.size, "or targets were not needed"
    assert f"0 morph targets, at most {stated:.2g} m" in written.note
    near = read_back.Gltf(path).gltf.meshes[-1].extras
    assert near["error_m"] < FAR * creature.size
    assert near["error_by_skinning_alone_m"] == stated


@pytest.mark.parametrize("name", RUNS)
def test_trimesh_opens_it(name: str, files: Files) -> None:
    creature, path = files[name]
    scene = trimesh.load(path)
    assert len(scene.geometry) == len(creature.surfaces) + len(creature.skins)


def test_what_is_wrong_is_one_message(
    chain: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(fb.SceneError, match=r"targets is -1\. Give 0 or more"):
        fb.export(chain, tmp_path / "out.glb", {"targets": -1})
    monkeypatch.setitem(__import__("sys").modules, "pygltflib", None)
    with pytest.raises(fb.SceneError, match=r"made by pygltflib, .*flowborne\[gltf\]"):
        fb.export(chain, tmp_path / "out.glb")
    assert not list(tmp_path.iterdir())
