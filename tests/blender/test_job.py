"""Jobs of the Blender extension: a child process that is stepped, without Blender."""

from __future__ import annotations

import shutil
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from blender.environment import engine_command
from blender.job import CHARACTER, Job
from blender.motion import MotionError, read_motion, read_skin
from blender.process import IDLE, JobError, State
from blender.reaction import Reaction

import flowborne as fb
from blender import process

from ..characters import rigged

ENGINE = sys.executable, "-m", "flowborne"

STUBBORN = """
import signal, sys, time
signal.signal(signal.SIGTERM, signal.SIG_IGN)
print("ready", flush=True)
time.sleep(60)
"""


def new_job(folder: Path, engine: tuple[str, ...] = ENGINE, **settings: object) -> Job:
    folder.mkdir()
    rigged.write_glb(folder / CHARACTER)
    given = {"cones": {}, "first": 11, "frames": 36, "rate": 24.0, "flow": (0.0, 6.0, 0.0)}
    return Job(engine, folder, Reaction(("tail",), **given | settings))


def finish(job: Job) -> State:
    until = time.monotonic() + 300.0
    while job.step() not in IDLE:
        assert time.monotonic() < until, "the job does not end"
        time.sleep(0.01)
    return job.state


def wait_for(job: Job, text: str) -> None:
    while text not in (job.folder / "log.txt").read_text():
        assert job.step() not in IDLE, job.message
        time.sleep(0.01)


def states(job: Job) -> list[bytes]:
    return [path.read_bytes() for path in sorted((job.run / "states").iterdir())]


def test_a_job_is_cancelled_resumed_and_the_same(tmp_path: Path) -> None:
    """The frames after a cancel and a restart of Blender are those of a run in one piece."""
    whole = new_job(tmp_path / "whole", cones={"tail": 30.0})
    assert whole.state is State.NEW
    whole.start()
    with pytest.raises(JobError, match="the run is in progress"):
        whole.start()
    assert whole.warnings == ()
    assert finish(whole) is State.DONE, whole.message
    assert whole.frames_done == 36
    assert whole.seconds_left is None
    assert whole.warnings == ()
    motion = read_motion(whole.run)
    assert motion.moving == ("handle", "tail")
    tail, trunk = motion.of("tail")[1], motion.of("trunk")[1]
    assert np.abs(np.swapaxes(trunk, 1, 2) @ tail - trunk[0].T @ tail[0]).max() > 0.05

    shutil.copytree(whole.folder, tmp_path / "parts", ignore=shutil.ignore_patterns("run"))
    parts = Job.load(ENGINE, tmp_path / "parts")
    assert parts.state is State.NEW
    parts.start()
    left = None
    while left is None and parts.step() not in IDLE:
        left = parts.seconds_left
    assert left is None or 0.0 < left < 300.0
    parts.cancel()
    ended = finish(parts)
    assert ended in (State.CANCELLED, State.DONE)
    again = Job.load(ENGINE, parts.folder)
    assert again.state is ended
    assert again.reaction == parts.reaction
    again.start()
    assert finish(again) is State.DONE, again.message
    assert states(again) == states(whole)
    assert fb.open_run(again.run).history["frame"].tolist() == list(range(1, 37))


def test_a_child_that_does_not_end_is_killed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(process, "GRACE_SECONDS", 0.1)
    job = new_job(tmp_path / "job", (sys.executable, "-c", STUBBORN))
    job.start()
    wait_for(job, "ready")
    job.cancel()
    assert finish(job) is State.CANCELLED
    assert job.frames_done == 0
    job.start()
    wait_for(job, "ready")
    job.close()
    assert job.step() is State.CANCELLED


def test_what_the_engine_says_is_the_message(tmp_path: Path) -> None:
    job = new_job(tmp_path / "job")
    (job.folder / CHARACTER).write_bytes(b"nothing")
    job.start()
    assert finish(job) is State.FAILED
    assert job.message.startswith("flowborne: character.glb")
    other = new_job(tmp_path / "other", (sys.executable, "-m", "flowborne_of_another_name"))
    other.start()
    assert finish(other) is State.FAILED
    assert "No module named flowborne_of_another_name" in other.message
    silent = new_job(tmp_path / "silent", (sys.executable, "-c", "raise SystemExit(7)"))
    silent.start()
    assert finish(silent) is State.FAILED
    assert silent.message == "it ended with code 7"
    tip = new_job(tmp_path / "tip")
    tip.reaction = Reaction(("tail_tip",), {}, 1, 36, 24.0)
    tip.start()
    assert finish(tip) is State.FAILED
    assert "bone 'tail_tip' moves nothing of its own" in tip.message


def test_engines(tmp_path: Path) -> None:
    for missing in ("", str(tmp_path), str(tmp_path / "none")):
        with pytest.raises(JobError, match=r"there is no flowborne in .*Make Environment"):
            engine_command(missing)
    python = tmp_path / "bin" / "python"
    python.parent.mkdir()
    python.touch()
    assert engine_command(str(tmp_path)) == (str(python), "-m", "flowborne")
    assert engine_command(str(python)) == (str(python), "-m", "flowborne")
    program = tmp_path / "flowborne"
    program.touch()
    assert engine_command(str(program)) == (str(program),)
    job = new_job(tmp_path / "job", (str(program),))
    with pytest.raises(JobError, match="cannot be started"):
        job.start()
    assert job.state is State.FAILED


def test_a_check_says_warnings_and_cost_before_the_run(tmp_path: Path) -> None:
    """The tail of the box is thinner than two of 16 cells; the run goes on from the check."""
    job = new_job(tmp_path / "job", simulated=True, resolution=16, frames=2)
    assert job.cost == ""
    job.start(only_check=True)
    assert finish(job) is State.CHECKED, job.message
    assert any("tail" in warning for warning in job.warnings), job.warnings
    cells, *_ = job.cost.split(" cells, ")
    assert job.cost.endswith(" GB, about 1 min")
    assert not job.run.exists()
    again = Job.load(ENGINE, job.folder)
    assert (again.warnings, again.cost) == (job.warnings, job.cost)
    again.start()
    assert finish(again) is State.DONE, again.message
    assert fb.open_run(again.run).summary["cells"] == int(cells)


def test_flesh_is_meshed_in_the_import_and_its_skin_is_read(tmp_path: Path) -> None:
    """Only flesh reacts: the tail is as in the clip, and stiff flesh is near its piece at rest."""
    job = new_job(tmp_path / "soft", frames=3, young=1e6, follows=True)
    job.start()
    assert finish(job) is State.DONE, job.message
    skin = read_skin(job.run)
    place, turned = read_motion(job.run).of(skin.body)
    local = np.einsum("fji,fkj->fki", turned, skin.vertices - place[:, None])
    assert skin.vertices.shape == (4, len(skin.rest), 3)
    assert np.median(np.abs(local[0] - skin.rest)) < 0.2
    with pytest.raises(MotionError, match="has no flesh to show"):
        read_skin(job.run, 9)


def test_an_engine_without_the_mesher_says_what_to_install(tmp_path: Path) -> None:
    without = "import sys; sys.modules['pyvista'] = None; import flowborne.__main__"
    job = new_job(tmp_path / "soft", (sys.executable, "-c", without), young=1e5)
    job.start()
    assert finish(job) is State.FAILED
    assert "meshes of flesh are made by PyVista, which is not installed" in job.message
    assert "flowborne[flesh]" in job.message
