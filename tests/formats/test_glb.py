"""Binary glTF, read back by pygltflib and trimesh, and skinned as glTF's specification says."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

import flowborne as fb
from flowborne.formats.creature import Creature
from flowborne.formats.glb import ExporterGlb
from flowborne.io.open_run import OpenRun

pygltflib = pytest.importorskip("pygltflib")

FAR = 1e-5
"""Distance from the run that is accepted, in sizes of the creature."""

TURNED = 1e-3
"""Angle from the run that is accepted, degrees."""

RUNS = ["chain", "fish", "walk"]

UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""From the run's axes, z up, to glTF's, y up."""


class Read:
    """A file, its arrays, and its nodes in a frame."""

    def __init__(self, path: Path) -> None:
        self.gltf = pygltflib.GLTF2().load(str(path))
        self.blob = self.gltf.binary_blob()

    def array(self, number: int) -> np.ndarray:
        kinds = {5126: np.float32, 5125: np.uint32, 5123: np.uint16}
        accessor = self.gltf.accessors[number]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}[accessor.type]
        view = self.gltf.bufferViews[accessor.bufferView]
        kind = kinds[accessor.componentType]
        found = np.frombuffer(self.blob, kind, accessor.count * width, view.byteOffset)
        return found.reshape(-1, width)

    def animated(self, frame: int) -> dict[tuple[int, str], np.ndarray]:
        """(node, property) -> its value."""
        (animation,) = self.gltf.animations
        found = {}
        for channel in animation.channels:
            values = self.array(animation.samplers[channel.sampler].output)
            if channel.target.path == "weights":
                count = len(self.array(animation.samplers[channel.sampler].input))
                values = values.reshape(count, -1)
            found[channel.target.node, channel.target.path] = values[frame]
        return found

    def nodes(self, frame: int) -> dict[int, np.ndarray]:
        """Node -> (4, 4) its frame to the scene's."""
        moved, found = self.animated(frame), {}

        def visit(number: int, above: np.ndarray) -> None:
            node = self.gltf.nodes[number]
            own = np.eye(4)
            turn = moved.get((number, "rotation"), node.rotation)
            shift = moved.get((number, "translation"), node.translation)
            if turn is not None:
                own[:3, :3] = Rotation.from_quat(turn).as_matrix()
            if shift is not None:
                own[:3, 3] = shift
            found[number] = above @ own
            for child in node.children or []:
                visit(child, found[number])

        for root in self.gltf.scenes[0].nodes:
            visit(root, np.eye(4))
        return found

    def vertices(self, number: int, frame: int) -> np.ndarray:
        """(k, 3) the mesh of a node in the scene, morphed and skinned."""
        node, nodes = self.gltf.nodes[number], self.nodes(frame)
        part = self.gltf.meshes[node.mesh].primitives[0]
        points = self.array(part.attributes.POSITION).astype(float)
        weights = self.animated(frame).get((number, "weights"), ())
        assert all(0.0 <= weight <= 1.0 for weight in weights), "Blender takes no others"
        for weight, target in zip(weights, part.targets or [], strict=True):
            points += weight * self.array(_position(target))
        points = np.c_[points, np.ones(len(points))]
        if node.skin is None:
            return (points @ nodes[number].T)[:, :3]
        skin = self.gltf.skins[node.skin]
        inverse = self.array(skin.inverseBindMatrices).reshape(-1, 4, 4).swapaxes(1, 2)
        moved = np.array([nodes[j] for j in skin.joints]) @ inverse
        joints = self.array(part.attributes.JOINTS_0)
        shares = self.array(part.attributes.WEIGHTS_0)
        return np.einsum("km,kmij,kj->ki", shares, moved[joints], points)[:, :3]


def _position(target: Any) -> int:
    return target["POSITION"] if isinstance(target, dict) else target.POSITION


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


@pytest.mark.parametrize("name", RUNS)
def test_every_mesh_is_where_the_run_has_it(name: str, files: Files) -> None:
    creature, path = files[name]
    read, model, seen = Read(path), creature.model, set()
    skins = {skin.name: skin for skin in creature.skins}
    for number, node in enumerate(read.gltf.nodes):
        if node.mesh is None:
            continue
        seen.add(node.name)
        for frame in range(len(creature.run)):
            state = creature.run.state(frame)
            if node.name in skins:
                wanted = state["flesh_vertices"][skins[node.name].chosen]
            else:
                geom = model.geom_names.index(node.name)
                own, faces = model.geom_shape[geom].triangles()
                wanted = own @ state["geom_rotation"][geom].T + state["geom_position"][geom]
                part = read.gltf.meshes[node.mesh].primitives[0]
                assert_array_equal(read.array(part.indices).ravel(), np.ravel(faces))
            found = read.vertices(number, frame) @ UP
            assert_allclose(found, wanted, atol=FAR * creature.size)
    assert seen == {*model.geom_names, *skins}


@pytest.mark.parametrize("name", RUNS)
def test_joints_turn_as_in_the_run_at_its_rate(name: str, files: Files) -> None:
    creature, path = files[name]
    read, skeleton = Read(path), creature.skeleton
    (animation,) = read.gltf.animations
    times = read.array(animation.samplers[0].input).ravel()
    assert_allclose(times, np.arange(len(creature.run)) / creature.run.frames_per_second, rtol=1e-6)
    joints = read.gltf.skins[0].joints
    assert [read.gltf.nodes[joint].name for joint in joints] == list(skeleton.names)
    for frame in range(len(creature.run)):
        nodes = read.nodes(frame)
        found = np.array([UP.T @ nodes[joint][:3, :3] for joint in joints])
        away = np.einsum("nji,njk->nik", found, skeleton.rotation[frame])
        assert np.degrees(Rotation.from_matrix(away).magnitude()).max() < TURNED
        places = np.array([nodes[joint][:3, 3] @ UP for joint in joints])
        assert_allclose(places, skeleton.position[frame], atol=FAR * creature.size)


def test_flesh_says_how_near_it_is(files: Files, fish: Path, tmp_path: Path) -> None:
    """Without targets the error that is stated is the one that is found."""
    creature, path = files["fish"]
    written = ExporterGlb(targets=0).write(OpenRun(fish), tmp_path / "bare.glb")
    read, (skin,) = Read(tmp_path / "bare.glb"), creature.skins
    (number,) = (n for n, node in enumerate(read.gltf.nodes) if node.name == "skin" and node.mesh)
    found = [
        read.vertices(number, frame) @ UP - creature.run.state(frame)["flesh_vertices"][skin.chosen]
        for frame in range(len(creature.run))
    ]
    stated = read.gltf.meshes[read.gltf.nodes[number].mesh].extras["error_m"]
    assert np.linalg.norm(found, axis=2).max() == pytest.approx(stated, rel=1e-3)
    assert stated > FAR * creature.size, "or targets were not needed"
    assert f"0 morph targets, at most {stated:.2g} m" in written.note
    near = Read(path).gltf.meshes[-1].extras
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
