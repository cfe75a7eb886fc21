"""USD, read back by usd-core: its validators, its skinning, and the run's numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

import flowborne as fb
from flowborne.base.colours import to_linear
from flowborne.formats.creature import Creature

pytest.importorskip("pxr")
from pxr import Gf, Usd, UsdGeom, UsdShade, UsdSkel, UsdValidation, UsdVol

read_back = pytest.importorskip("read_back", exc_type=ImportError)

FAR = 1e-5
"""Distance from the run that is accepted, in sizes of the creature."""

TURNED = 1e-3
"""Angle from the run that is accepted, degrees."""

RUNS = ["chain", "fish", "walk", "drift"]


@pytest.fixture(scope="module")
def stages(
    tmp_path_factory: pytest.TempPathFactory, chain: Path, fish: Path, walk: Path, drift: Path
) -> dict[str, tuple[Creature, Usd.Stage]]:
    """Name -> creature of the run, and its stage."""
    folder, opened = tmp_path_factory.mktemp("usd"), {}
    for run, ending in ((chain, ".usda"), (fish, ".usd"), (walk, ".usdc"), (drift, ".usda")):
        path = folder / f"{run.name}{ending}"
        fb.export(run, path)
        opened[run.name] = (Creature(fb.open_run(run)), Usd.Stage.Open(str(path)))
    return opened


Stages = dict[str, tuple[Creature, Usd.Stage]]


@pytest.mark.parametrize("name", RUNS)
def test_usd_finds_nothing_wrong(name: str, stages: Stages) -> None:
    registry = UsdValidation.ValidationRegistry()
    context = UsdValidation.ValidationContext(registry.GetOrLoadAllValidators())
    errors = [error.GetErrorAsString() for error in context.Validate(stages[name][1])]
    assert not errors


@pytest.mark.parametrize("name", RUNS)
def test_the_stage_has_rate_frames_unit_axis_and_names(name: str, stages: Stages) -> None:
    creature, stage = stages[name]
    run = creature.run
    assert stage.GetTimeCodesPerSecond() == stage.GetFramesPerSecond() == run.frames_per_second
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (0.0, len(run) - 1.0)
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    assert UsdGeom.GetStageUpAxis(stage) == "Z"
    assert stage.GetDefaultPrim().GetCustomDataByKey("scene") == run.name
    assert stage.GetDefaultPrim().GetDisplayName() == run.name
    meshes = {p.GetDisplayName() for p in stage.Traverse() if p.IsA(UsdGeom.Mesh)}
    flesh = () if creature.model.flesh is None else creature.model.flesh.names
    assert meshes == {*creature.model.geom_names, *flesh}


@pytest.mark.parametrize("name", RUNS)
def test_joints_are_where_the_run_has_them(name: str, stages: Stages) -> None:
    """By UsdSkel's own query, frame by frame, in the skeleton's space."""
    creature, read = stages[name][0], read_back.Stage(stages[name][1])
    skeleton, query = creature.skeleton, read.query
    assert len(query.GetAnimQuery().GetJointTransformTimeSamples()) == len(creature.run)
    assert UsdSkel.Topology(query.GetJointOrder()).GetParentIndices() == skeleton.parents.tolist()
    for frame in range(len(creature.run)):
        joints = read.joints(frame)
        assert list(joints) == list(skeleton.names)
        found = np.array(list(joints.values()))
        assert_allclose(found[:, :3, 3], skeleton.position[frame], atol=FAR * creature.size)
        away = np.einsum("nji,njk->nik", found[:, :3, :3], skeleton.rotation[frame])
        assert np.degrees(Rotation.from_matrix(away).magnitude()).max() < TURNED


@pytest.mark.parametrize("name", RUNS)
def test_surfaces_go_with_their_bodies(name: str, stages: Stages) -> None:
    """Skinned by UsdSkel, each vertex is where the run's pose of its geometry puts it."""
    creature, read = stages[name][0], read_back.Stage(stages[name][1])
    model, run = creature.model, creature.run
    for frame in range(len(run)):
        wanted = read_back.meshes_of(creature, frame)
        for part, points in read.meshes(frame).items():
            assert_allclose(points, wanted[part], atol=FAR * creature.size)
    for prim in read.stage.Traverse():
        if prim.IsA(UsdGeom.Mesh) and prim.GetDisplayName() in model.geom_names:
            faces = model.geom_shape[model.geom_names.index(prim.GetDisplayName())].triangles()[1]
            indices = UsdGeom.Mesh(prim).GetFaceVertexIndicesAttr().Get()
            assert_array_equal(indices, np.ravel(faces))
    assert len(read.bound) == sum(s.bone >= 0 for s in creature.surfaces) + len(creature.skins)


@pytest.mark.parametrize("name", RUNS)
def test_surfaces_have_the_models_colours(name: str, stages: Stages) -> None:
    creature, stage = stages[name]
    colours = {surface.name: to_linear(surface.rgba[:3]) for surface in creature.surfaces}
    for prim in stage.Traverse():
        if prim.IsA(UsdGeom.Mesh) and prim.GetDisplayName() in colours:
            material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
            shader, _, _ = material.ComputeSurfaceSource()
            seen = shader.GetInput("diffuseColor").Get()
            assert_allclose(seen, colours[prim.GetDisplayName()], atol=1e-6)


def test_flesh_is_where_the_run_has_it_and_bound_to_its_bones(stages: Stages) -> None:
    creature, stage = stages["fish"]
    (skin,) = creature.skins
    mesh = UsdGeom.Mesh.Get(stage, "/Run/Flesh/skin")
    assert mesh.GetPointsAttr().GetTimeSamples() == [float(f) for f in range(len(creature.run))]
    for frame in range(len(creature.run)):
        vertices = creature.run.state(frame)["flesh_vertices"]
        assert_array_equal(mesh.GetPointsAttr().Get(frame), vertices[skin.chosen])
    guide = stage.GetPrimAtPath("/Run/Creature/Bound/skin")
    binding = UsdSkel.BindingAPI(guide)
    count = binding.GetJointIndicesPrimvar().GetElementSize()
    bones = np.reshape(binding.GetJointIndicesPrimvar().Get(), (-1, count))
    shares = np.reshape(binding.GetJointWeightsPrimvar().Get(), (-1, count))
    weights = np.zeros_like(skin.weights)
    np.add.at(weights, (np.arange(len(bones))[:, None], bones), shares)
    assert_allclose(weights, skin.weights, atol=1e-6)
    assert_allclose(UsdGeom.Mesh(guide).GetPointsAttr().Get(), skin.vertices, atol=1e-7)


@pytest.mark.parametrize("name", ["chain", "fish"])
def test_forces_are_the_runs(name: str, stages: Stages) -> None:
    creature, stage = stages[name]
    curves = UsdGeom.BasisCurves.Get(stage, "/Run/Forces")
    scale = curves.GetPrim().GetCustomDataByKey("metresPerNewton")
    force = UsdGeom.PrimvarsAPI(curves).GetPrimvar("force")
    for frame in range(len(creature.run)):
        state = creature.run.state(frame)
        exerted = state["fluid_force"][1:]
        assert_array_equal(force.Get(frame), exerted)
        arrows = np.reshape(curves.GetPointsAttr().Get(frame), (-1, 2, 3))
        assert_allclose(arrows[:, 0], state["fluid_centre"][1:], atol=1e-6)
        assert_allclose(arrows[:, 1] - arrows[:, 0], scale * exerted, atol=FAR * creature.size)


@pytest.mark.parametrize("name", RUNS)
def test_paths_go_through_the_bones_and_the_camera_sees_them(name: str, stages: Stages) -> None:
    """Through a lens of 50 mm: USD counts it in tenths of the unit of length."""
    creature, stage = stages[name]
    paths = UsdGeom.BasisCurves.Get(stage, "/Run/Paths")
    shape = (len(creature.skeleton.names), len(creature.run), 3)
    points = np.reshape(paths.GetPointsAttr().Get(), shape)
    assert_allclose(points, np.swapaxes(creature.skeleton.position, 0, 1), atol=1e-6)
    camera = UsdGeom.Camera.Get(stage, "/Run/Camera").GetCamera(0.0)
    assert camera.focalLength * UsdGeom.GetStageMetersPerUnit(stage) == pytest.approx(0.5)
    low, high = creature.bounds
    corners = np.where(np.indices((2, 2, 2)).reshape(3, -1).T, low, high)
    assert all(camera.frustum.Intersects(Gf.Vec3d(*corner)) for corner in corners)


@pytest.mark.parametrize(("name", "dye"), [("chain", "dye"), ("fish", "smoke"), ("drift", "dye")])
def test_dye_is_a_volume_in_files_beside(name: str, dye: str, stages: Stages) -> None:
    tinyvdb = pytest.importorskip("tinyvdb")
    creature, stage = stages[name]
    volume = UsdVol.Volume.Get(stage, f"/Run/Dye/{dye}")
    field = UsdVol.OpenVDBAsset.Get(stage, volume.GetFieldPath("density"))
    assert field.GetFieldNameAttr().Get() == dye
    for frame in range(len(creature.run)):
        with tinyvdb.open(field.GetFilePathAttr().Get(frame).resolvedPath) as file:
            file.read_grids()
            (found,) = (file.grid(n) for n in range(file.grid_count) if file.grid(n).name == dye)
            values = creature.run.state(frame)[f"scalar_{dye}"]
            assert found.active_voxel_count() == (values != 0.0).sum()
        grid = creature.run.grid_at(creature.run.state(frame))
        assert_allclose(volume.GetExtentAttr().Get(frame), [grid.origin, grid.upper], atol=1e-6)


def test_a_missing_library_is_one_message(
    chain: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "pxr.Usd", None)
    with pytest.raises(
        fb.SceneError, match=r"'.usdc' files are made by usd-core, .*flowborne\[usd\]"
    ):
        fb.export(chain, tmp_path / "out.usdc")
    assert not list(tmp_path.iterdir())
