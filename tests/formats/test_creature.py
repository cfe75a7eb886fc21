"""Runs whose bodies are few or none, in every format that draws bodies."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

import flowborne as fb
from flowborne.runs.exporters import own_exporters

ROOM = """
dimensions = 2
[domain]
lower = [0, 0]
upper = [1, 1]
resolution = 8
[fluid]
"""

PILLAR = """
<mujoco><worldbody><geom name="pillar" type="cylinder" size="0.2 1" pos="0.5 0.5 0"/></worldbody>
</mujoco>
"""


@pytest.fixture(scope="module")
def room(runs: Path) -> Path:
    """Water alone."""
    (runs / "room.toml").write_text(ROOM)
    fb.run(runs / "room.toml", runs / "room", frames=2, film=False)
    return runs / "room"


@pytest.fixture(scope="module")
def pillar(runs: Path) -> Path:
    """Water around a geometry that is no body's."""
    (runs / "pillar.xml").write_text(PILLAR)
    (runs / "pillar.toml").write_text(ROOM + '[solids]\nmodel = "pillar.xml"\n')
    fb.run(runs / "pillar.toml", runs / "pillar", frames=2, film=False)
    return runs / "pillar"


@pytest.mark.parametrize("ending", [".bvh", ".glb", ".usd"])
def test_a_run_without_bodies_is_refused(ending: str, room: Path, tmp_path: Path) -> None:
    with pytest.raises(fb.SceneError, match=r"room has no bodies. Add \[solids\] or \[human\]"):
        fb.export(room, tmp_path / f"out{ending}")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("ending", own_exporters())
def test_what_stays_is_written_too(ending: str, pillar: Path, tmp_path: Path) -> None:
    for file in fb.export(pillar, tmp_path / f"out{ending}").files:
        assert file.stat().st_size > 0


def test_water_alone_is_written_where_there_is_room_for_it(room: Path, tmp_path: Path) -> None:
    for ending in (".csv", ".parquet", ".vdb", ".vtkhdf"):
        assert fb.export(room, tmp_path / f"out{ending}").files


def test_an_unknown_ending_is_refused(chain: Path, tmp_path: Path) -> None:
    with pytest.raises(fb.SceneError, match=r"nothing writes '.fbx' files. End its name with one"):
        fb.export(chain, tmp_path / "out.fbx")


def test_a_run_that_was_stopped_gives_the_frames_that_it_has(chain: Path, tmp_path: Path) -> None:
    shutil.copytree(chain, tmp_path / "run")
    for number in (3, 4):
        (tmp_path / "run" / "states" / f"{number:06d}.npz").unlink()
    assert len(fb.export(tmp_path / "run", tmp_path / "out.vdb").files) == 3
    for path in (tmp_path / "run" / "states").iterdir():
        path.unlink()
    with pytest.raises(fb.RunFolderError, match=r"has no frame yet; continue the run with"):
        fb.export(tmp_path / "run", tmp_path / "none.vdb")
