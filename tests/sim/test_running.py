import gc
import json
import os
import random
import signal
import sys
import threading
import time
import tracemalloc
from collections import namedtuple

import numpy as np
import pytest
import threadpoolctl
from numba.core.errors import TypingError

import flowborne
from flowborne.base.errors import SceneError
from flowborne.runs import recorder, run_folder
from flowborne.runs.history import History
from flowborne.runs.run_folder import RunFolder, RunFolderError
from flowborne.sim import running
from flowborne.sim.endings import RunOutcome
from flowborne.sim.simulation import Simulation

from ..made_runs import numbers, run, start, summary_of, wait_for_rows

FRAMES = 12


@pytest.fixture
def reference(small_scene, tmp_path):
    """Numbers of an uninterrupted run of the small scene."""
    run(small_scene, tmp_path / "reference")
    return numbers(tmp_path / "reference")


def test_a_run_leaves_everything_behind(small_scene, tmp_path):
    out = tmp_path / "run"
    result = run(small_scene, out)
    assert (result.outcome, result.frames) == (RunOutcome.DONE, FRAMES)
    history, states, _ = numbers(out)
    assert [row["frame"] for row in history] == [str(n) for n in range(1, FRAMES + 1)]
    assert sorted(states) == [f"{n:06d}.npz" for n in range(FRAMES + 1)]
    last = np.load(out / "states" / f"{FRAMES:06d}.npz")
    assert float(history[-1]["angle_hinge_rad"]) == pytest.approx(float(last["q"][0]), abs=1e-6)
    assert last["fluid_force"].shape == last["fluid_centre"].shape == (2, 3)
    summary = summary_of(out)
    assert summary["outcome"] == "done"
    assert summary["final"]["angle_hinge_rad"] == float(history[-1]["angle_hinge_rad"])
    assert summary["seconds_per_frame"] > 0
    assert summary["peak_memory_bytes"] > summary["state_bytes"] > 0
    model = json.loads((out / "model.json").read_text())
    assert (model["controlled"], model["wind"], model["slab"]) == (["hinge"], [[5, 0, 0]], True)
    assert [geom["type"] for geom in model["geoms"]] == ["box"]
    assert model["frames_per_second"] == 24.0


def test_the_folder_is_a_scene_that_gives_the_same_run(small_scene, tmp_path, reference):
    run(small_scene, tmp_path / "a")
    os.remove(small_scene)
    run(tmp_path / "a" / "scene.toml", tmp_path / "b")
    assert numbers(tmp_path / "b") == reference


def test_workers_change_no_number(small_scene, tmp_path, reference):
    run(small_scene, tmp_path / "run", workers=2)
    assert numbers(tmp_path / "run") == reference


def in_child(action):
    """Run `action` in a forked child; the signal that ended it, or 0."""
    sys.stdout.flush()
    child = os.fork()
    if child == 0:
        code = 1
        try:
            action()
            code = 0
        finally:
            os._exit(code)
    _, status = os.waitpid(child, 0)
    assert os.WIFSIGNALED(status) or os.WEXITSTATUS(status) == 0
    return os.WTERMSIG(status) if os.WIFSIGNALED(status) else 0


def killed_at(moment, action):
    """`action`, with SIGKILL at the moment-th time that something reaches the disc.

    Those times are: before a whole file takes its name, before a file is forced to the disc, and
    in the middle of a row of the history.
    """
    left = moment

    def count():
        nonlocal left
        left -= 1
        return left == 0

    def kill():
        os.kill(os.getpid(), signal.SIGKILL)

    def before(function):
        def counted(*args):
            if count():
                kill()
            return function(*args)

        return counted

    def half_a_row(history, values, append=History.append):
        if count():
            history._file.write(",".join(str(values[c]) for c in history.columns[:3]).encode())
            kill()
        append(history, values)

    def act():
        os.replace, os.fsync = before(os.replace), before(os.fsync)
        History.append = half_a_row
        action()

    return in_child(act)


def test_a_kill_at_any_moment_and_resume_end_with_the_same_numbers(
    small_scene, tmp_path, reference
):
    moments = random.Random(2).sample(range(1, 60), 12)
    for moment in moments:
        out = tmp_path / f"run-{moment}"
        again = random.Random(moment).randrange(1, 30)
        assert killed_at(moment, lambda out=out: run(small_scene, out)) == signal.SIGKILL
        if not (out / "scene.toml").exists():
            run(small_scene, out, replace=True)
        else:
            killed_at(again, lambda out=out: run(small_scene, out, resume=True))
            run(small_scene, out, resume=True)
        assert numbers(out) == reference, f"killed at {moment}, then at {again}"
        assert not list(out.rglob("*.partial")), f"killed at {moment}, then at {again}"


KILLED = [
    ("ns-chain-1", {"domain.resolution": "24"}, (32, 40)),
    ("fish", {"domain.resolution": "12", "controller.every": "8"}, (35,)),
]


@pytest.mark.parametrize(("name", "settings", "moments"), KILLED)
def test_a_killed_run_in_a_flow_ends_with_the_same_numbers(tmp_path, name, settings, moments):
    """A controlled chain in a fluid with dye, and flesh: all of the state has to be in the
    checkpoint, and the mesh in the folder."""
    shorter = {"time.frames": "8", "output.checkpoint_every": "3"}
    scene = flowborne.load_scene(name, settings | shorter)
    run(scene, tmp_path / "whole")
    for moment in moments:
        out = tmp_path / f"run-{moment}"
        assert killed_at(moment, lambda out=out: run(scene, out)) == signal.SIGKILL
        assert 0 < len(numbers(out)[0]) < 8
        run(scene, out, resume=True)
        assert numbers(out) == numbers(tmp_path / "whole")


def test_a_run_that_plans_goes_on_between_two_decisions(small_scene, tmp_path):
    settings = {"controller": "{ knots = 3, every = 4 }"}
    scene = flowborne.load_scene(small_scene, settings)
    run(scene, tmp_path / "whole", frames=FRAMES)
    for frames in (6, FRAMES):
        run(scene, tmp_path / "parts", frames=frames, resume=frames > 6)
    assert numbers(tmp_path / "parts") == numbers(tmp_path / "whole")
    with np.load(tmp_path / "parts" / "checkpoint.npz") as checkpoint:
        assert any("plan" in name for name in checkpoint.files)


def test_a_run_killed_before_its_scene_was_written_says_how_to_start_again(small_scene, tmp_path):
    out = tmp_path / "run"
    RunFolder.create(out)
    with pytest.raises(RunFolderError, match="start it again with replace=True"):
        run(small_scene, out, resume=True)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_a_run_well(small_scene, tmp_path, number):
    out = tmp_path / "run"
    process = start([small_scene, "--out", out, "--frames", "100000", "--no-film"])
    wait_for_rows(process, out / "history.csv", 7)
    process.send_signal(number)
    _, said = process.communicate()
    assert process.returncode == 130
    frames = summary_of(out)["frames"]
    assert f"stopped after frame {frames}; continue with: flowborne run" in said
    assert "Traceback" not in said
    with np.load(out / "checkpoint.npz") as checkpoint:
        assert checkpoint["frame"] == frames
    history, states, _ = numbers(out)
    assert (len(history), len(states)) == (frames, frames + 1)
    run(small_scene, out, resume=True, frames=frames + 3)
    run(small_scene, tmp_path / "whole", frames=frames + 3)
    assert numbers(out) == numbers(tmp_path / "whole")


def test_a_killed_command_can_be_gone_on_with(small_scene, tmp_path):
    out = tmp_path / "run"
    process = start([small_scene, "--out", out, "--frames", "100000", "--no-film"])
    wait_for_rows(process, out / "history.csv", 23)
    process.kill()
    process.communicate()
    rows = (out / "history.csv").read_text().count("\n")
    run(small_scene, out, resume=True, frames=rows + 5)
    run(small_scene, tmp_path / "whole", frames=rows + 5)
    assert numbers(out) == numbers(tmp_path / "whole")


def test_a_signal_between_a_frame_and_its_record_loses_nothing(small_scene, tmp_path, monkeypatch):
    advance = Simulation.advance_frame

    def interrupted(simulation):
        advance(simulation)
        if simulation.frame == 7:
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(1)
        return simulation.report

    monkeypatch.setattr(Simulation, "advance_frame", interrupted)
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(running.RunInterrupted) as stopped:
        run(small_scene, tmp_path / "run")
    assert stopped.value.result.frames == len(numbers(tmp_path / "run")[0]) == 7
    assert signal.getsignal(signal.SIGINT) is before


@pytest.mark.parametrize("made", [SystemError, TypingError])
def test_a_signal_that_numba_turns_into_an_error_ends_the_run_well(
    small_scene, tmp_path, monkeypatch, reference, made
):
    """As its wrapper does when a handler raises in it, and its compiler."""
    advance = Simulation.advance_frame

    def interrupted(simulation):
        if simulation.frame == 4:
            try:
                os.kill(os.getpid(), signal.SIGINT)
                time.sleep(1)
            except KeyboardInterrupt as stop:
                raise made("of an interrupt") from stop
        return advance(simulation)

    with monkeypatch.context() as patch:
        patch.setattr(Simulation, "advance_frame", interrupted)
        with pytest.raises(running.RunInterrupted, match="stopped after frame 4"):
            run(small_scene, tmp_path / "run")
    run(small_scene, tmp_path / "run", resume=True)
    assert numbers(tmp_path / "run") == reference


def test_an_error_of_a_kernel_is_no_interrupt(small_scene, tmp_path, monkeypatch):
    def fail(simulation):
        raise SystemError("unknown opcode")

    monkeypatch.setattr(Simulation, "advance_frame", fail)
    with pytest.raises(SystemError, match="unknown opcode"):
        run(small_scene, tmp_path / "run")


def test_a_scene_too_large_for_the_memory_writes_nothing(small_scene, tmp_path, monkeypatch):
    def refuse(*args, **options):
        raise MemoryError("Unable to allocate 74.5 GiB")

    monkeypatch.setattr("flowborne.scenes.build.build", refuse)
    with pytest.raises(SceneError, match=r"scene small does not fit .* 74.5 GiB.*coarser"):
        run(small_scene, tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_a_run_in_another_thread_leaves_signals_alone(small_scene, tmp_path, reference):
    thread = threading.Thread(target=run, args=(small_scene, tmp_path / "run"))
    thread.start()
    thread.join()
    assert numbers(tmp_path / "run") == reference


def test_resuming_adds_frames_and_a_finished_run_stays_as_it_is(small_scene, tmp_path, reference):
    out = tmp_path / "run"
    run(small_scene, out, frames=4)
    assert run(small_scene, out, resume=True).frames == 4
    assert run(small_scene, out, resume=True, frames=FRAMES).frames == FRAMES
    assert numbers(out) == reference
    with pytest.raises(RunFolderError, match=f"has {FRAMES} frames already"):
        run(small_scene, out, resume=True, frames=FRAMES - 1)
    assert numbers(out) == reference


def test_resuming_another_scene_is_refused(small_scene, tmp_path, reference):
    out = tmp_path / "run"
    run(small_scene, out)
    other = flowborne.load_scene(small_scene, {"solids.density": "200"})
    with pytest.raises(RunFolderError, match=r"solids.density is 100.0 there and 200.0 here"):
        run(other, out, resume=True)
    model = small_scene.parent / "block.xml"
    model.write_text(model.read_text().replace("0.5 0.1 1", "0.5 0.2 1"))
    with pytest.raises(RunFolderError, match=r"block.xml differs"):
        run(small_scene, out, resume=True)
    assert numbers(out) == reference


def test_a_torn_checkpoint_is_reported(small_scene, tmp_path):
    out = tmp_path / "run"
    run(small_scene, out, frames=2)
    (out / "checkpoint.npz").write_bytes(b"torn")
    with pytest.raises(RunFolderError, match=r"is not a checkpoint .*replace=True"):
        run(small_scene, out, resume=True)


def test_too_little_room_is_found_before_anything_is_written(small_scene, tmp_path, monkeypatch):
    usage = namedtuple("usage", "total used free")
    monkeypatch.setattr(run_folder.shutil, "disk_usage", lambda path: usage(10**9, 10**9, 0))
    with pytest.raises(RunFolderError, match="0 MB are free; make room"):
        run(small_scene, tmp_path / "run")
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("full", ["state", "checkpoint"])
def test_a_disc_that_fills_up_stops_the_run_and_keeps_what_is_there(
    small_scene, tmp_path, monkeypatch, reference, full
):
    out = tmp_path / "run"

    def refuse_after(frames, write):
        def refuse(*args, **options):
            if len(list((out / "states").glob("0*.npz"))) > frames:
                raise OSError(28, "No space left on device")
            return write(*args, **options)

        return refuse

    with monkeypatch.context() as patch:
        if full == "state":
            patch.setattr(recorder, "write_atomically", refuse_after(7, recorder.write_atomically))
        else:
            patch.setattr(running, "save_checkpoint", refuse_after(7, running.save_checkpoint))
        result = run(small_scene, out)
    last = 7 if full == "state" else 10
    assert result.outcome is RunOutcome.NOT_WRITTEN
    assert f"failed after frame {last} (No space left on device)" in result.message
    history, states, _ = numbers(out)
    assert (len(history), len(states)) == (last, last + 1)
    run(small_scene, out, resume=True)
    assert numbers(out) == reference


def test_a_disc_that_is_full_at_once_leaves_no_folder(small_scene, tmp_path, monkeypatch):
    def refuse(*args, **options):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(running, "save_checkpoint", refuse)
    with pytest.raises(RunFolderError, match="No space left on device"):
        run(small_scene, tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_a_blow_up_keeps_everything_before_it(small_scene, tmp_path, monkeypatch):
    from flowborne.coupling import step as stepping

    step = stepping.step

    def blow_up(world, dt, drive=None):
        report = step(world, dt, drive)
        if world.time > 8.5 / 24:
            world.solid.v[:] = np.inf
        return report

    drawn = []
    with monkeypatch.context() as patch:
        patch.setattr(stepping, "step", blow_up)
        patch.setattr("flowborne.view.film.make_preview", lambda folder, _: drawn.append(folder))
        result = run(small_scene, tmp_path / "run", film=True)
    assert result.outcome is RunOutcome.BLEW_UP
    assert "blew up in frame 9, step 2: a joint's position or velocity is not" in result.message
    assert drawn == [tmp_path / "run"]
    history, states, _ = numbers(tmp_path / "run")
    assert (len(history), len(states)) == (8, 9)
    assert summary_of(tmp_path / "run")["outcome"] == "blew_up"
    run(small_scene, tmp_path / "run", resume=True, frames=10)
    run(small_scene, tmp_path / "whole", frames=10)
    assert numbers(tmp_path / "run") == numbers(tmp_path / "whole")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"frames": 0}, "frames is 0; give a whole number from 1"),
        ({"workers": -1}, "workers is -1; give a whole number from 1"),
        ({"resume": True, "replace": True}, "exclude each other"),
        ({"resume": True}, "there is no folder"),
    ],
)
def test_bad_arguments_write_nothing(small_scene, tmp_path, options, message):
    with pytest.raises((RunFolderError, SceneError), match=message):
        run(small_scene, tmp_path / "run", **options)
    assert not (tmp_path / "run").exists()


def test_a_bad_scene_writes_nothing(small_scene, tmp_path):
    small_scene.write_text(small_scene.read_text().replace("density = 100.0", "density = -1.0"))
    with pytest.raises(SceneError, match="density"):
        run(small_scene, tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_news_is_given_of_every_frame(small_scene, tmp_path):
    news = []
    run(small_scene, tmp_path / "run", progress=news.append)
    assert [item.stage for item in news] == ["start"] + ["frame"] * FRAMES
    assert [item.frame for item in news[1:]] == list(range(1, FRAMES + 1))
    assert news[-1].joints[0][0] == "angle_hinge_rad"
    assert all(np.isfinite(item.objective) for item in news[1:])


def test_memory_does_not_grow_with_frames(small_scene, tmp_path):
    """What threadpoolctl remembers of its libraries, 80 bytes each, fills up over 300 frames."""
    held = []
    ours = [tracemalloc.Filter(False, threadpoolctl.__file__)]

    def note(news):
        if news.stage == "frame" and news.frame in (100, 250):
            gc.collect()
            traces = tracemalloc.take_snapshot().filter_traces(ours).statistics("filename")
            held.append(sum(trace.size for trace in traces))

    run(small_scene, tmp_path / "warm", frames=2)
    tracemalloc.start()
    try:
        run(small_scene, tmp_path / "run", frames=250, progress=note)
    finally:
        tracemalloc.stop()
    assert held[1] - held[0] < 8_000, held
