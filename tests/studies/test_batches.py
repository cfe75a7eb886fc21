"""A folder of clips through one scene."""

import os
import re
from urllib.parse import unquote

import numpy as np
import pytest

import flowborne
from flowborne.cli import main as cli
from flowborne.motion.bvh import write_clip
from flowborne.motion.human.gait import gait_clip
from flowborne.motion.human.skeleton import standard_skeleton
from flowborne.runs.run_folder import RunFolder, RunFolderError
from flowborne.sim.running import run
from flowborne.studies.batches import _as_captured, _until_the_end, run_clips

from ..made_runs import numbers

SCENE = "human-wind-back"
FEW = {"time.frames": "4"}


@pytest.fixture
def clips(tmp_path):
    """Folder with two walks, the second of 3 frames, and what is no clip."""
    folder = tmp_path / "clips"
    (folder / "more").mkdir(parents=True)
    (folder / "notes.txt").write_text("mine")
    for name, size in (("a walk", 1.741), ("b", 1.6)):
        write_clip(folder / f"{name}.bvh", gait_clip(standard_skeleton(size)))
    text = (folder / "b.bvh").read_text().splitlines()
    first = next(n for n, line in enumerate(text) if line.startswith("Frame Time"))
    step = float(text[first].split()[-1])
    rows = text[first + 1 :][: round(3 / 24 / step) + 1]
    text[first - 1] = f"Frames: {len(rows)}"
    (folder / "b.bvh").write_text("\n".join([*text[: first + 1], *rows]) + "\n")
    return folder


def batch_of(clips, **options):
    given = {"overrides": FEW, "workers": 1, "film": False} | options
    return run_clips(SCENE, clips, clips.parent / "out", **given)


def captured_b(clips):
    """The scene of the second clip as captured."""
    scene = flowborne.load_scene(SCENE, FEW | {"clip.file": str(clips / "b.bvh")})
    return _as_captured(_until_the_end(scene)[0])


def test_each_clip_has_its_runs_and_a_place_on_the_page(clips):
    batch = batch_of(clips)
    assert batch.skipped == ("more/", "notes.txt")
    assert [(d.clip.name, d.frames, d.failure) for d in batch.clips] == [
        ("a walk.bvh", 4, ""),
        ("b.bvh", 3, ""),
    ]
    assert batch.clips[1].duration == pytest.approx(3 / 24, abs=0.01)
    text = batch.page.read_text()
    for done in batch.clips:
        assert f"{done.before:.3g} N m as captured, {done.after:.3g} N m in the run" in text
        assert done.ratio == done.after / done.before
        assert all(note.startswith("[clip]: " + done.clip.name) for note in done.notes)
        assert done.notes[0] in text
    assert "Skipped, not BVH files: more/, notes.txt" in text
    links = re.findall(r'(?:href|src)="([^"]*)"', text)
    assert len(links) == 4
    assert all((batch.page.parent / unquote(link)).exists() for link in links)


def test_a_run_is_that_of_the_command_and_its_effort_that_of_its_drives(clips):
    batch = batch_of(clips)
    done = batch.clips[0]
    alone = clips.parent / "alone"
    scene = flowborne.load_scene(SCENE, FEW | {"clip.file": str(done.clip)})
    run(scene, alone, workers=1, film=False)
    assert numbers(alone) == numbers(done.folder)
    simulation = flowborne.Simulation(scene, workers=1)
    dofs = simulation.setup.solid.dofs_of("lower_back")
    reports = [simulation.advance_frame() for _ in range(4)]
    torques = [np.linalg.norm(r.mean(lambda step: step.actuator)[dofs]) for r in reports]
    assert done.after == pytest.approx(np.median(torques))


def test_as_captured_the_controlled_joints_follow_the_clip(clips):
    overrides = FEW | {"objectives.0.joints": '["left_elbow"]', "human.elbows": "true"}
    overrides |= {"control.0.joints": '["left_shoulder"]'}
    batch = batch_of(clips, overrides=overrides)
    assert not any(done.failure for done in batch.clips)
    scene = (batch.clips[0].captured / "scene.toml").read_text()
    assert "[[control]]" not in scene
    history = flowborne.open_run(batch.clips[0].captured).history
    assert {"torque_left_shoulder_x_Nm", "torque_left_elbow_Nm"} <= set(history)
    assert history["angle_left_elbow_rad"] == pytest.approx(history["target_left_elbow_rad"])


def test_a_failing_clip_stops_no_other_and_the_same_call_continues(clips, monkeypatch):
    (clips / "a broken.bvh").write_text("HIERARCHY\nROOT\n")
    began = []

    def counted(scene, out, **options):
        began.append((os.path.relpath(out, clips.parent / "out"), options["resume"]))
        if len(began) == 3:
            raise KeyboardInterrupt
        return run(scene, out, **options)

    monkeypatch.setattr("flowborne.studies.batches.run", counted)
    with pytest.raises(KeyboardInterrupt, match="stopped in clip 3 of 3: b"):
        batch_of(clips)
    assert "2 of 3 clips" in (clips.parent / "out" / "index.html").read_text()
    run(captured_b(clips), clips.parent / "out" / "captured" / "b", frames=2, film=False)
    batch = batch_of(clips)
    assert [bool(done.failure) for done in batch.clips] == [True, False, False]
    assert began[3:] == [("captured/b", True), ("b", False)]
    before = [numbers(done.folder) for done in batch.clips[1:]]
    assert [d.after for d in batch_of(clips).clips] == [d.after for d in batch.clips]
    assert len(began) == 5
    assert [done.frames for done in batch.clips] == [0, 4, 3]
    batch_of(clips, replace=True)
    assert len(began) == 9
    assert [numbers(done.folder) for done in batch.clips[1:]] == before
    assert "[clip]: a broken.bvh" in batch.clips[0].failure
    assert f"Failed: {batch.clips[0].failure}" in batch.page.read_text()


def test_without_an_effort_as_captured_the_page_says_why(clips):
    folder = clips.parent / "fin"
    folder.mkdir()
    joints = "<freejoint name='root'/><geom size='0.1'/>"
    fin = "<body><joint name='fin'/><geom size='0.1' pos='0.3 0 0'/></body>"
    (folder / "fin.xml").write_text(
        f"<mujoco><worldbody><body>{joints}{fin}</body></worldbody></mujoco>"
    )
    free = "[time]\nframes = 2\n[solids]\nmodel = 'fin.xml'\ndensity = 500.0\n[clip]\n"
    driven = "[[control]]\njoints = ['fin']\nstrength = 30.0\nprobe = 2.0\n"
    (folder / "free.toml").write_text(free + f"file = '{clips / 'b.bvh'}'\n")
    (folder / "fin.toml").write_text(
        (folder / "free.toml").read_text() + driven + "[[objectives]]\nkind = 'effort'\n"
    )
    for scene, why, effort in (
        ("free", "no joint is controlled", "none: no joint is controlled"),
        ("fin", "the clip has no motion of fin", "N m in the run"),
    ):
        batch = run_clips(folder / f"{scene}.toml", clips, clips.parent / scene, film=False)
        assert [(d.failure, d.before, d.captured) for d in batch.clips] == [("", None, None)] * 2
        assert batch.clips[0].notes[0] == f"no effort as captured: {why}"
        assert effort in batch.page.read_text()


def test_a_run_of_another_scene_is_not_continued(clips):
    batch_of(clips)
    batch = batch_of(clips, overrides=FEW | {"human.mass": "90"})
    assert all("holds a run of another scene" in done.failure for done in batch.clips)


def test_wrong_folders_are_refused_before_anything_is_written(clips, small_scene):
    out = clips.parent / "out"
    empty = clips.parent / "empty"
    empty.mkdir()
    for folder, said in (
        (clips.parent / "nowhere", "there is no folder .*nowhere; give a folder"),
        (clips / "b.bvh", "b.bvh is a file; give a folder"),
        (empty, "empty has nothing and no BVH file"),
        (clips / "more", "more has nothing and no BVH file"),
    ):
        with pytest.raises(RunFolderError, match=said):
            run_clips(SCENE, folder, out)
    with pytest.raises(flowborne.SceneError, match=r"scene small has no \[clip\]"):
        run_clips(small_scene, clips, out)
    with pytest.raises(flowborne.SceneError, match="unknown key 'colour'"):
        run_clips(SCENE, clips, out, overrides={"human.colour": "1"})
    with pytest.raises(flowborne.SceneError, match="workers is 0; give a whole number from 1"):
        run_clips(SCENE, clips, out, workers=0)
    (clips / "captured.bvh").write_text("")
    with pytest.raises(
        RunFolderError, match="and the clips as captured would both be written to captured; rename"
    ):
        run_clips(SCENE, clips, out)
    (clips / "captured.bvh").rename(clips / "B.BVH")
    with pytest.raises(RunFolderError, match="rename the clip"):
        run_clips(SCENE, clips, out)
    assert not out.exists()


def test_a_page_of_others_is_not_replaced(clips):
    page = clips.parent / "out" / "index.html"
    page.parent.mkdir()
    page.write_text("<title>mine</title>")
    with pytest.raises(RunFolderError, match=r"index.html was not made by flowborne; name another"):
        batch_of(clips)
    assert page.read_text() == "<title>mine</title>"


def test_pictures_are_drawn_of_both_runs(clips, monkeypatch):
    (clips / "b.bvh").unlink()
    overrides = FEW | {"time.frames": "2", "film.size": "[160, 96]"}
    batch = batch_of(clips, overrides=overrides, film=True)
    done = batch.clips[0]
    assert done.failure == ""
    assert RunFolder(done.folder).film.exists()
    assert RunFolder(done.captured).picture.exists()
    assert 'src="captured/a%20walk/preview.png"' in batch.page.read_text()

    def fail(folder):
        raise ValueError("this machine cannot draw")

    monkeypatch.setattr("flowborne.view.film.make_picture", fail)
    drawn_before = batch_of(clips, overrides=overrides, film=True)
    assert drawn_before.clips == batch.clips
    RunFolder(done.captured).picture.unlink()
    (without,) = batch_of(clips, overrides=overrides, film=True).clips
    assert (without.failure, without.notes[0]) == ("", "no picture: this machine cannot draw")


def test_the_command_names_each_clip_and_ends_with_1_if_one_failed(clips, capsys, monkeypatch):
    monkeypatch.chdir(clips.parent)
    (clips / "a walk.bvh").write_text("HIERARCHY\nROOT\n")
    options = ["--clips", "clips", "--frames", "3", "--workers", "1", "--no-film"]
    for progress in ("", ": complete"):
        with pytest.raises(SystemExit) as left:
            cli.main(["run", SCENE, *options])
        said = capsys.readouterr()
        assert left.value.code == 1
        assert f"clip 2 of 2: b.bvh, as captured{progress}\n" in said.err
        assert f"clip 2 of 2: b.bvh{progress}\n" in said.err
        assert "flowborne: a walk.bvh: scene human-wind-back.toml, [clip]: a walk.bvh" in said.err
        lines = said.out.splitlines()
        assert lines[0].startswith("b.bvh: 3 frames, effort ")
        assert lines[1:] == [
            "skipped, not BVH: more/, notes.txt",
            "page: runs/human-wind-back-clips/index.html",
        ]
