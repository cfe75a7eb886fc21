"""Faults of a machine, on purpose: nothing saved is lost, and one message says what to do."""

import os
import random
import shutil
import signal
import time
import zipfile

import numpy as np
import pytest

import flowborne
from flowborne.base.errors import WorkerError
from flowborne.cli import main as cli
from flowborne.control.executors import Processes
from flowborne.runs.run_folder import LOCK_NAME, RunFolder, RunFolderError
from flowborne.sim import running
from flowborne.sim.endings import RunInterrupted, RunOutcome
from flowborne.sim.simulation import BlowUpError, Simulation

from .made_runs import numbers, run, start, summary_of, wait_for_rows

FRAMES = 12


def said(capsys, *arguments):
    """Exit code of a command, and what it says on stderr."""
    with pytest.raises(SystemExit) as end:
        cli.main([str(argument) for argument in arguments])
    return end.value.code, capsys.readouterr().err


def test_a_second_run_into_the_folder_of_one_that_goes_on_is_refused(small_scene, tmp_path):
    out = tmp_path / "run"
    process = start([small_scene, "--out", out, "--frames", "100000", "--no-film"])
    try:
        for rows, option in ((3, "resume"), (6, "replace")):
            wait_for_rows(process, out / "history.csv", rows)
            with pytest.raises(RunFolderError, match=r"being written into .*another folder"):
                run(small_scene, out, **{option: True})
        wait_for_rows(process, out / "history.csv", 9)
    finally:
        process.send_signal(signal.SIGINT)
        process.communicate()
    rows = [int(row["frame"]) for row in numbers(out)[0]]
    assert rows == list(range(1, summary_of(out)["frames"] + 1))


def test_two_runs_at_once_into_a_new_folder(small_scene, tmp_path):
    """One of them is written, and the other says why it is not."""
    out = tmp_path / "run"
    both = [start([small_scene, "--out", out, "--frames", "300", "--no-film"]) for _ in range(2)]
    told = [process.communicate()[1] for process in both]
    assert sorted(process.returncode for process in both) == [0, 2]
    refused = told[[process.returncode for process in both].index(2)]
    assert refused.count("\n") == 1
    assert "flowborne: " in refused
    assert len(numbers(out)[0]) == 300


def test_the_lock_of_a_killed_run_is_gone(small_scene, tmp_path):
    out = tmp_path / "run"
    process = start([small_scene, "--out", out, "--frames", "100000", "--no-film"])
    wait_for_rows(process, out / "history.csv", 25)
    process.kill()
    process.communicate()
    assert (out / LOCK_NAME).exists()
    result = run(small_scene, out, resume=True, frames=30)
    assert (result.outcome, len(numbers(out)[0])) == (RunOutcome.DONE, 30)


def test_what_could_not_begin_leaves_no_folder(tmp_path):
    folder = RunFolder(tmp_path / "run")
    with pytest.raises(RuntimeError), folder.locked():
        raise RuntimeError
    assert not folder.path.exists()


FILES = ["checkpoint.npz", "history.csv", "model.json", "scene.toml", "states", "summary.json"]


@pytest.mark.parametrize("name", FILES)
def test_files_cut_by_a_loss_of_power_are_one_message_each(small_scene, tmp_path, capsys, name):
    """Whatever is cut, and wherever: each command works or says one thing, and names the folder."""
    whole = tmp_path / "whole"
    run(small_scene, whole, frames=6)
    numbers_of = random.Random(name)
    for cut in range(4):
        out = tmp_path / f"run-{cut}"
        shutil.copytree(whole, out)
        path = out / name if name != "states" else out / "states" / "000003.npz"
        content = path.read_bytes()
        keep = 0 if cut == 0 else numbers_of.randrange(1, len(content))
        path.write_bytes(content[:keep] + (b"\0" * (len(content) - keep) if cut == 3 else b""))
        for command in (
            ("run", small_scene, "--out", out, "--resume", "--frames", 8, "--no-film"),
            ("film", out, "--out", tmp_path / "frame.png"),
            ("export", out, "--out", tmp_path / "table.csv"),
        ):
            code, text = said(capsys, *command)
            assert code in (0, 2), (command, text)
            messages = [line for line in text.splitlines() if line.startswith("flowborne: ")]
            assert len(messages) == (0 if code == 0 else 1), (command, text)
            assert "Traceback" not in text
            assert "fault of flowborne" not in text
            assert code == 0 or str(out) in text, (command, text)


def test_a_state_that_is_cut_costs_its_frame_alone(small_scene, tmp_path, capsys):
    out = tmp_path / "run"
    run(small_scene, out, frames=6)
    path = RunFolder(out).state(3)
    path.write_bytes(path.read_bytes()[:100])
    code, text = said(capsys, "run", small_scene, "--out", out, "--resume", "--frames", 8)
    assert (code, text.count("\n")) == (2, 1)
    assert f"state {path} cannot be read (" in text
    assert "); remove it, and films and exports go on without its frame" in text
    path.unlink()
    assert run(small_scene, out, resume=True, frames=8, film=True).outcome is RunOutcome.DONE
    run(small_scene, tmp_path / "reference", frames=8)
    history, states, files = numbers(out)
    expected = numbers(tmp_path / "reference")
    assert (history, files) == (expected[0], expected[2])
    assert states == {name: bytes_ for name, bytes_ in expected[1].items() if name != path.name}
    assert list(flowborne.open_run(out).frames) == [0, 1, 2, 4, 5, 6, 7, 8]


def test_states_are_on_the_disc_before_the_checkpoint_that_speaks_of_them(
    small_scene, tmp_path, monkeypatch
):
    """A loss of power leaves no checkpoint of frames whose states are lost."""
    synced, order = os.fsync, []

    def note(descriptor):
        order.append(os.path.basename(os.readlink(f"/proc/self/fd/{descriptor}")))
        synced(descriptor)

    monkeypatch.setattr(os, "fsync", note)
    run(small_scene, tmp_path / "run")
    last = len(order) - 1 - order[::-1].index(".checkpoint.npz.partial")
    assert {f"{frame:06d}.npz" for frame in range(FRAMES + 1)} <= set(order[:last])
    assert "history.csv" in order[:last]


@pytest.mark.parametrize("content", [np.arange(3.0), {"frame": 3}, {"frame": "x"}, "pickled"])
def test_a_checkpoint_of_another_kind_is_one_message(small_scene, tmp_path, content):
    out = tmp_path / "run"
    run(small_scene, out, frames=2)
    with open(out / "checkpoint.npz", "wb") as file:
        if isinstance(content, dict):
            np.savez(file, **content)
        elif isinstance(content, str):
            np.save(file, np.array([content, {}], object), allow_pickle=True)
        else:
            np.save(file, content)
    with pytest.raises(RunFolderError, match=r"is not a checkpoint .*replace=True"):
        run(small_scene, out, resume=True)


def test_a_locked_archive_is_one_message(small_scene, tmp_path):
    out = tmp_path / "run"
    run(small_scene, out, frames=2)
    with zipfile.ZipFile(out / "checkpoint.npz", "w") as archive:
        archive.writestr("frame.npy", b"no array")
    with pytest.raises(RunFolderError, match=r"is not a checkpoint .*replace=True"):
        run(small_scene, out, resume=True)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_may_only_be_read(small_scene, tmp_path):
    out = tmp_path / "run"
    run(small_scene, out, frames=2)
    out.chmod(0o500)
    try:
        with pytest.raises(RunFolderError, match="cannot be written"):
            run(small_scene, out, resume=True, frames=4)
    finally:
        out.chmod(0o700)


def interrupted(*arguments):
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(1)


def test_ctrl_c_while_starting_writes_nothing_and_says_so(small_scene, tmp_path, monkeypatch):
    monkeypatch.setattr(Simulation, "_start", interrupted)
    with pytest.raises(KeyboardInterrupt, match="stopped before anything was written"):
        run(small_scene, tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_ctrl_c_in_a_command_is_one_line(small_scene, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Simulation, "_start", interrupted)
    for command, said in (
        (("run", "--out", "run"), "stopped before anything was written"),
        (("check",), "interrupted"),
    ):
        with pytest.raises(SystemExit) as end:
            cli.main([*command, str(small_scene)])
        assert end.value.code == 130
        assert capsys.readouterr().err.splitlines()[-1] == f"flowborne: {said}"
        assert not (tmp_path / "run").exists()


def test_ctrl_c_while_starting_keeps_an_earlier_run(small_scene, tmp_path, monkeypatch):
    out = tmp_path / "run"
    run(small_scene, out)
    before = numbers(out)
    monkeypatch.setattr(Simulation, "_start", interrupted)
    with pytest.raises(KeyboardInterrupt, match="stopped before anything was written"):
        run(small_scene, out, replace=True)
    assert numbers(out) == before


def test_ctrl_c_while_drawing_says_how_to_draw(small_scene, tmp_path, monkeypatch):
    out = tmp_path / "run"
    monkeypatch.setattr("flowborne.view.film.make_preview", interrupted)
    with pytest.raises(RunInterrupted, match=f"draw with: flowborne film {out}") as stopped:
        run(small_scene, out, film=True)
    assert stopped.value.result.outcome is RunOutcome.DONE
    assert summary_of(out)["outcome"] == "done"


def test_ctrl_c_between_the_frames_and_the_film_draws_none(small_scene, tmp_path, monkeypatch):
    out, summarised = tmp_path / "run", running.summarise

    def late(*arguments):
        os.kill(os.getpid(), signal.SIGINT)
        return summarised(*arguments)

    monkeypatch.setattr(running, "summarise", late)
    with pytest.raises(RunInterrupted, match="stopped while drawing"):
        run(small_scene, out, film=True)
    assert not (out / "preview.png").exists()


def test_a_number_that_is_not_finite_never_ends_well(small_scene, tmp_path, monkeypatch):
    """Not even one that no solver needs."""
    from flowborne.sim.columns import Columns

    values = Columns.values

    def spoilt(columns, now, **given):
        return values(columns, now, **given) | ({"lift_N": np.nan} if now.frame == 5 else {})

    monkeypatch.setattr(Columns, "values", spoilt)
    result = run(small_scene, tmp_path / "run")
    assert result.outcome is RunOutcome.BLEW_UP
    assert "blew up in frame 5, step" in result.message
    assert "lift_N is not a finite number" in result.message
    assert len(numbers(tmp_path / "run")[0]) == 4


KILLED = "__import__('os').kill(__import__('os').getpid(), 9)"


def once(path):
    """An expression that ends its process where it is evaluated first, and is "done" later."""
    file = f"__import__('pathlib').Path({str(path)!r})"
    return f"{file}.exists() and 'done' or ({file}.touch(), {KILLED})"


def test_a_worker_that_dies_is_replaced(tmp_path):
    pool = Processes(2)
    try:
        assert pool.map(eval, ["1", once(tmp_path / "died"), "3"]) == [1, "done", 3]
        assert pool.map(eval, ["4", once(tmp_path / "died"), "6"]) == [4, "done", 6]
        with pytest.raises(WorkerError, match=r"2 worker processes one died.*fewer workers"):
            pool.map(eval, [KILLED, KILLED])
        assert pool.map(eval, ["7", "8"]) == [7, 8]
    finally:
        pool.close()


def test_a_run_without_workers_tells_how_to_go_on(small_scene, tmp_path, monkeypatch):
    def dead(simulation):
        error = WorkerError("of 2 worker processes one died")
        raise BlowUpError(simulation.frame + 1, 1, str(error)) from error

    monkeypatch.setattr(Simulation, "advance_frame", dead)
    message = run(small_scene, tmp_path / "run").message
    assert "the run stopped in frame 1, step 1: of 2 worker processes one died" in message
    assert "then continue with: flowborne run" in message
    assert "more steps" not in message
