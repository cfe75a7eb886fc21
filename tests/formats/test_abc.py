"""Alembic caches, read back by alembic3d: vertices, times and names are the run's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import flowborne as fb
from flowborne.formats.creature import Creature

read_back = pytest.importorskip("read_back", exc_type=ImportError)

FAR = 1e-5
"""Distance from the run that is accepted, in sizes of the creature."""


@pytest.mark.parametrize("name", ["chain", "fish", "walk"])
def test_meshes_are_where_the_run_has_them(
    name: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    run = fb.open_run(request.getfixturevalue(name))
    creature = Creature(run)
    model, skins = creature.model, {skin.name: skin for skin in creature.skins}
    path = tmp_path / "run.abc"
    fb.export(run.folder, path)
    read = read_back.Alembic(path)
    for frame in range(len(run)):
        found, wanted = read.meshes(frame), read_back.meshes_of(creature, frame)
        assert set(found) == set(wanted)
        for part, points in found.items():
            if part in skins:
                outward = skins[part].faces
            else:
                outward = model.geom_shape[model.geom_names.index(part)].triangles()[1]
            assert_allclose(points, wanted[part], atol=FAR * creature.size)
            assert np.array_equal(read.faces[part], outward[:, ::-1]), "Alembic winds clockwise"


def test_times_are_the_runs(fish: Path, tmp_path: Path) -> None:
    fb.export(fish, tmp_path / "run.abc")
    run = fb.open_run(fish)
    read = read_back.Alembic(tmp_path / "run.abc")
    for name in ("skin", "skull"):
        times = read.times_of(name)
        assert_allclose(times, np.arange(len(run)) / run.frames_per_second, atol=1e-12)


def test_a_missing_library_is_one_message(
    chain: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "alembic3d", None)
    with pytest.raises(fb.SceneError, match=r"made by alembic3d, .*flowborne\[alembic\]"):
        fb.export(chain, tmp_path / "out.abc")
    assert not list(tmp_path.iterdir())
