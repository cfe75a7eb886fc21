"""Alembic caches, read back by alembic3d: vertices, times and names are the run's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import flowborne as fb
from flowborne.formats.creature import Creature

abc = pytest.importorskip("alembic3d.Abc")
geom = pytest.importorskip("alembic3d.AbcGeom")

FAR = 1e-5
"""Distance from the run that is accepted, in sizes of the creature."""

UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""From the run's axes, z up, to the file's, y up."""


def meshes(path: Path, time: float) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Name -> places (k, 3) in the run's axes and triangles (m, 3) at a time, s."""
    top, found = abc.IArchive(str(path)).getTop(), {}
    for n in range(top.getNumChildren()):
        child, move = top.getChild(n), np.eye(4)
        name = child.getName()
        if geom.IXform.matches(child.getHeader()):
            transform = geom.IXform(top, name).getSchema()
            sample = transform.getValue(abc.ISampleSelector(time))
            move = np.array(sample.getMatrix(), float).reshape(4, 4)
            mesh = geom.IPolyMesh(child, child.getChild(0).getName()).getSchema()
        else:
            mesh = geom.IPolyMesh(top, name).getSchema()
        sample = mesh.getValue(abc.ISampleSelector(time))
        points = np.array(sample.getPositions(), float)
        assert set(np.array(sample.getFaceCounts())) == {3}
        faces = np.array(sample.getFaceIndices()).reshape(-1, 3)
        found[name] = ((points @ move[:3, :3] + move[3, :3]) @ UP, faces)
    return found


@pytest.mark.parametrize("name", ["chain", "fish", "walk"])
def test_meshes_are_where_the_run_has_them(
    name: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    run = fb.open_run(request.getfixturevalue(name))
    creature = Creature(run)
    model, skins = creature.model, {skin.name: skin for skin in creature.skins}
    path = tmp_path / "run.abc"
    fb.export(run.folder, path)
    for frame in range(len(run)):
        state, found = run.state(frame), meshes(path, frame / run.frames_per_second)
        assert set(found) == {*model.geom_names, *skins}
        for part, (points, faces) in found.items():
            if part in skins:
                wanted = state["flesh_vertices"][skins[part].chosen]
                outward = skins[part].faces
            else:
                geometry = model.geom_names.index(part)
                own, outward = model.geom_shape[geometry].triangles()
                turn, place = state["geom_rotation"][geometry], state["geom_position"][geometry]
                wanted = own @ turn.T + place
            assert_allclose(points, wanted, atol=FAR * creature.size)
            assert np.array_equal(faces, outward[:, ::-1]), "Alembic winds clockwise"


def test_times_are_the_runs(fish: Path, tmp_path: Path) -> None:
    fb.export(fish, tmp_path / "run.abc")
    run = fb.open_run(fish)
    top = abc.IArchive(str(tmp_path / "run.abc")).getTop()
    for schema in (geom.IPolyMesh(top, "skin").getSchema(), geom.IXform(top, "skull").getSchema()):
        assert schema.getNumSamples() == len(run)
        sampling = schema.getTimeSampling()
        times = [sampling.getSampleTime(n) for n in range(len(run))]
        assert_allclose(times, np.arange(len(run)) / run.frames_per_second, atol=1e-12)


def test_a_missing_library_is_one_message(
    chain: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "alembic3d", None)
    with pytest.raises(fb.SceneError, match=r"made by alembic3d, .*flowborne\[alembic\]"):
        fb.export(chain, tmp_path / "out.abc")
    assert not list(tmp_path.iterdir())
