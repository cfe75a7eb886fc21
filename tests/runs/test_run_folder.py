import os
import shutil
from collections import namedtuple

import pytest

from flowborne.runs import run_folder
from flowborne.runs.run_folder import RunFolder, RunFolderError, check_space


def finished_run(path):
    folder = RunFolder.create(path)
    folder.mark(["block.xml", "meshes/fin.obj"])
    (path / "meshes").mkdir()
    for name in ("scene.toml", "history.csv", "block.xml", "meshes/fin.obj", "checkpoint.npz"):
        (path / name).write_text("a run's")
    for frame in range(3):
        folder.state(frame).write_text("a run's")
    return folder


def files_in(path):
    return sorted(str(p.relative_to(path)) for p in path.rglob("*") if p.is_file())


def test_a_new_folder_is_made_with_its_parents_and_marked(tmp_path):
    folder = RunFolder.create(tmp_path / "runs" / "block")
    assert folder.is_run()
    assert files_in(folder.path) == ["summary.json"]


def test_an_earlier_run_is_kept_unless_replaced(tmp_path):
    path = finished_run(tmp_path / "run").path
    before = files_in(path)
    with pytest.raises(RunFolderError, match=r"resume=True.*replace=True"):
        RunFolder.create(path)
    assert files_in(path) == before


def test_replacing_removes_only_what_a_run_writes(tmp_path):
    path = finished_run(tmp_path / "run").path
    (path / "notes.txt").write_text("mine")
    (path / "states" / "drawing.png").write_text("mine")
    (path / ".history.csv.partial").write_text("torn")
    (path / "states" / ".000003.npz.partial").write_text("torn")
    RunFolder.create(path, replace=True)
    assert files_in(path) == ["notes.txt", "states/drawing.png", "summary.json"]
    assert not (path / "meshes").exists()


def test_somebody_elses_folder_is_refused_even_with_replace(tmp_path):
    (tmp_path / "scene.toml").write_text("mine")
    for replace in (False, True):
        with pytest.raises(RunFolderError, match="was not made by a run"):
            RunFolder.create(tmp_path, replace=replace)
    assert files_in(tmp_path) == ["scene.toml"]


def test_model_files_outside_the_folder_are_never_touched(tmp_path):
    (tmp_path / "outside.xml").write_text("mine")
    folder = finished_run(tmp_path / "run")
    impossible = ["a" * 1000, "nul\0.xml", "b/" * 2000 + "c"]
    folder.mark(["../outside.xml", str(tmp_path / "outside.xml"), "block.xml", *impossible])
    assert folder.model_files() == ["block.xml"]
    RunFolder.create(folder.path, replace=True)
    assert (tmp_path / "outside.xml").read_text() == "mine"


def test_a_run_killed_before_it_began_can_be_started_again(tmp_path):
    (tmp_path / "states").mkdir()
    (tmp_path / ".summary.json.partial").write_text("{")
    assert RunFolder.create(tmp_path).is_run()


@pytest.mark.parametrize("below", ["file", "file/run"])
def test_a_file_is_no_place_for_a_run(tmp_path, below):
    (tmp_path / "file").write_text("mine")
    with pytest.raises(RunFolderError, match="file"):
        RunFolder.create(tmp_path / below)


def test_a_place_that_cannot_be_written_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    for place in (tmp_path, tmp_path / "new"):
        with pytest.raises(RunFolderError, match="cannot be written; name another folder"):
            RunFolder.create(place)


def test_a_run_that_cannot_be_written_can_be_read(tmp_path, monkeypatch):
    finished_run(tmp_path / "run")
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    folder = RunFolder.existing(tmp_path / "run")
    with pytest.raises(RunFolderError, match="run cannot be written; make it and its"):
        folder.check_writable()


def test_later_states_are_dropped(tmp_path):
    folder = finished_run(tmp_path / "run")
    (folder.states / ".000009.npz.partial").write_text("torn")
    folder.drop_states_after(1)
    assert files_in(folder.states) == ["000000.npz", "000001.npz"]


def test_removing_takes_the_folder_when_nothing_else_is_in_it(tmp_path):
    folder = RunFolder.create(tmp_path / "run")
    folder.remove()
    assert not folder.path.exists()


def test_only_a_run_folder_can_be_gone_on_with(tmp_path):
    with pytest.raises(RunFolderError, match="there is no folder"):
        RunFolder.existing(tmp_path / "nowhere")
    with pytest.raises(RunFolderError, match="is not the folder of a run"):
        RunFolder.existing(tmp_path)


def test_space_is_looked_for_where_the_folder_will_be(tmp_path, monkeypatch):
    usage = namedtuple("usage", "total used free")
    asked = []

    def disk_usage(path):
        asked.append(path)
        return usage(10**9, 10**9 - 5000, 5000)

    monkeypatch.setattr(run_folder.shutil, "disk_usage", disk_usage)
    check_space(tmp_path / "not" / "yet", 5000)
    with pytest.raises(RunFolderError, match=r"needs about 10 MB.* 0 MB are free"):
        check_space(tmp_path / "not" / "yet", 10_000_000)
    assert asked == [tmp_path, tmp_path]


@pytest.mark.parametrize("linked", ["meshes", "states", "history.csv", "meshes/deep"])
def test_nothing_behind_a_link_is_written_or_removed(tmp_path, linked):
    folder = finished_run(tmp_path / "run")
    folder.mark(["block.xml", "meshes/fin.obj", "meshes/deep/thesis.obj"])
    outside = tmp_path / "outside"
    outside.mkdir()
    for name in ("fin.obj", "000001.npz", "thesis.obj"):
        (outside / name).write_text("mine")
    before = files_in(outside)
    link = folder.path / linked
    if link.is_dir():
        shutil.rmtree(link)
    link.unlink(missing_ok=True)
    link.symlink_to(outside / "fin.obj" if link.suffix else outside)
    for touch in (
        lambda: RunFolder.create(folder.path, replace=True),
        folder.check_writable,
        folder.remove,
    ):
        with pytest.raises(RunFolderError, match=rf"{linked} is a symbolic link.*remove the link"):
            touch()
    assert files_in(outside) == before
    assert folder.is_run()


@pytest.mark.parametrize(
    "summary", ['["flowborne"]', '{"flowborne": 1, "model_files": 3}', "[" * 9999]
)
def test_a_summary_of_another_form_names_no_files(tmp_path, summary):
    (tmp_path / "summary.json").write_text(summary)
    assert RunFolder(tmp_path).model_files() == []
