"""Whatever ends a run: its frames are written, its status is true, and it can be continued."""

import errno
import os
import re

import numpy as np
import pytest

from flowborne.base import given
from flowborne.cli import main as cli
from flowborne.runs import checkpoint, recorder, run_folder, states
from flowborne.runs.history import History
from flowborne.runs.run_folder import RunFolder, RunFolderError
from flowborne.scenes import save
from flowborne.sim import running
from flowborne.sim.endings import RunInterrupted, RunOutcome
from flowborne.sim.simulation import BlowUpError, Simulation

from ..made_runs import numbers, run, start, summary_of

FRAMES, LAST = 12, 7
"""Frames of the small scene, and the last one before the error; checkpoints are of every fifth."""

ARM = """<mujoco><worldbody><body name="arm"><joint name="hinge" axis="0 1 0"/>
<geom type="capsule" size="0.05 0.2" pos="0 0 -0.2"/></body></worldbody>
<actuator><motor name="motor" joint="hinge"/></actuator></mujoco>"""

SCENE = """
plugins = ["{module}.py"]
[time]
frames_per_second = 24.0
frames = 12
[solids]
model = "arm.xml"
[output]
checkpoint_every = 5
[policy]
function = "{module}:steer"
joints = ["hinge"]
actuators = ["motor"]
"""

STEER = """import flowborne as fb
def steer(sim):
    right = {{'hinge': fb.Torque(0.1)}}
    return {given} if sim.frame == 7 else right
"""

GIVEN = {
    "nan": ("{'hinge': fb.Torque(float('nan'))}", "the command to 'hinge' has nan: give a finite"),
    "size": ("{'hinge': fb.Torque([1.0, 2.0])}", r"the command to 'hinge' has \[1.0, 2.0\]: give"),
    "word": ("{'hinge': fb.Velocity('fast')}", "the command to 'hinge' has 'fast': give a finite"),
    "kind": ("{'hinge': 3.0}", "the command to 'hinge' is 3.0: give a Position"),
    "control": ("{'motor': fb.Control(float('inf'))}", "the command to 'motor' has inf"),
    "name": ("{'hunge': fb.Torque(0.0)}", "tells hunge: name it in joints"),
    "number": ("{1: fb.Torque(0.0), 'x': fb.Torque(0.0)}", "tells 1, x: name it in joints"),
    "none": ("None", r"failed in .*\.py, line \d+ \(TypeError"),
    "raised": ("1 / 0", r"failed in steer_raised.py, line 4 \(ZeroDivisionError"),
    "exit": ("exit()", r"failed in .*\(SystemExit"),
}
"""What a policy gives, and what the message says of it."""


def steered(folder, module, given):
    """File of a scene whose policy gives a wrong command in the frame after LAST."""
    (folder / "scene.toml").write_text(SCENE.format(module=module))
    (folder / "arm.xml").write_text(ARM)
    (folder / f"{module}.py").write_text(STEER.format(given=given))
    return folder / "scene.toml"


def message_of(out, outcome="failed", saved=LAST):
    """Message of a run that ended after its frame LAST, which has to be on the disc.

    saved  frame of the checkpoint
    """
    summary = summary_of(out)
    assert (summary["outcome"], summary["frames"]) == (outcome, LAST)
    history, written, _ = numbers(out)
    assert (len(history), len(written)) == (LAST, LAST + 1)
    with np.load(out / "checkpoint.npz") as arrays:
        assert int(arrays["frame"]) == saved
    assert f"--out {out} --resume" in summary["message"]
    return summary["message"]


@pytest.mark.parametrize("case", GIVEN)
def test_a_policy_with_a_wrong_command_loses_no_frame(tmp_path, capsys, case):
    command, said = GIVEN[case]
    module, out = f"steer_{case}", tmp_path / "run"
    scene = steered(tmp_path, module, command)
    with pytest.raises(SystemExit) as end:
        cli.main(["run", str(scene), "--out", str(out), "--no-film"])
    assert end.value.code == 1
    message = message_of(out)
    assert capsys.readouterr().err.splitlines()[-1] == f"flowborne: {message}"
    assert message.startswith(f"the run stopped in frame {LAST + 1}, step 1: policy '{module}:")
    assert re.search(said, message), message
    assert f"everything up to frame {LAST} is kept; correct {out / module}.py, then" in message


def test_a_policy_mended_as_the_message_says_continues_the_run(tmp_path):
    scene, out = steered(tmp_path, "steer_mended", "None"), tmp_path / "run"
    assert run(scene, out).outcome is RunOutcome.FAILED
    copy = out / "steer_mended.py"
    copy.write_text(copy.read_text().replace("None", "right"))
    command = summary_of(out)["message"].split("continue with: flowborne run ")[1]
    process = start([*command.split(), "--no-film"])
    assert (process.wait(), process.communicate()[1].count("flowborne:")) == (0, 0)
    assert (summary_of(out)["outcome"], len(numbers(out)[0])) == ("done", FRAMES)


@pytest.mark.parametrize("kind", [KeyError, MemoryError, OSError, SystemExit, ValueError])
def test_progress_that_raises_loses_no_frame(small_scene, tmp_path, kind):
    error = kind("of progress")

    def stop(news):
        if news.frame == LAST:
            raise error

    out = tmp_path / "run"
    with pytest.raises(kind) as raised:
        run(small_scene, out, progress=stop)
    assert raised.value is error
    message = message_of(out)
    assert message.startswith(f"the run stopped after frame {LAST} ({kind.__name__}")
    assert "test_endings.py, line" in message
    assert error.__notes__ == [message]
    run(small_scene, out, resume=True)
    run(small_scene, tmp_path / "whole")
    assert numbers(out) == numbers(tmp_path / "whole")


def test_progress_that_raises_at_the_start_leaves_a_run_of_no_frame(small_scene, tmp_path):
    def stop(news):
        raise RuntimeError(news.stage)

    with pytest.raises(RuntimeError, match="start"):
        run(small_scene, tmp_path / "run", progress=stop)
    assert summary_of(tmp_path / "run")["outcome"] == "failed"
    assert run(small_scene, tmp_path / "run", resume=True).outcome is RunOutcome.DONE


def test_an_interrupt_of_progress_is_one_of_the_run(small_scene, tmp_path):
    def stop(news):
        if news.frame == LAST:
            raise KeyboardInterrupt

    with pytest.raises(RunInterrupted, match=f"stopped after frame {LAST}"):
        run(small_scene, tmp_path / "run", progress=stop)
    message_of(tmp_path / "run", "interrupted")


def failing(function, error, after=LAST):
    """The function of a simulation, which raises in the frame after `after`."""

    def fail(simulation, *arguments):
        if simulation.frame == after:
            raise error
        return function(simulation, *arguments)

    return fail


@pytest.mark.parametrize(
    ("part", "error", "said"),
    [
        ("_advance", MemoryError("Unable to allocate"), "Unable to allocate.*; free some memory"),
        ("_advance", MemoryError(), "the memory is full.*; free some memory, then continue with"),
        ("_apply_changes", MemoryError(), "frame 8: the memory is full; .* free some memory"),
        ("advance_frame", BlowUpError(8, 1, "a fault", fault=True), "a fault; .*more steps"),
    ],
    ids=str,
)
def test_an_error_in_a_frame_loses_none(small_scene, tmp_path, monkeypatch, part, error, said):
    with monkeypatch.context() as patch:
        patch.setattr(Simulation, part, failing(getattr(Simulation, part), error))
        result = run(small_scene, tmp_path / "run")
    assert result.outcome is RunOutcome.FAILED
    assert result.message.startswith(f"the run stopped in frame {LAST + 1}")
    assert re.search(said, result.message), result.message
    summary = summary_of(tmp_path / "run")
    assert (summary["outcome"], summary["message"]) == ("failed", result.message)
    run(small_scene, tmp_path / "run", resume=True)
    run(small_scene, tmp_path / "whole")
    assert numbers(tmp_path / "run") == numbers(tmp_path / "whole")


@pytest.mark.parametrize(("error", "outcome"), [(MemoryError, "failed"), (OSError, "not_written")])
def test_a_frame_that_cannot_be_recorded_is_taken_back(
    small_scene, tmp_path, monkeypatch, error, outcome
):
    """The checkpoint is that of the frame before it."""
    write = recorder.Recorder.write

    def fail(self, frame, *given):
        if frame > LAST:
            raise error(errno.EIO, "Input/output error")
        write(self, frame, *given)

    out = tmp_path / "run"
    with monkeypatch.context() as patch:
        patch.setattr(recorder.Recorder, "write", fail)
        run(small_scene, out)
    assert f"frame {LAST} is kept" in message_of(out, outcome)
    run(small_scene, out, resume=True)
    run(small_scene, tmp_path / "whole")
    assert numbers(out) == numbers(tmp_path / "whole")


def test_a_fault_in_a_measure_is_raised_when_the_frames_are_saved(
    small_scene, tmp_path, monkeypatch, capsys
):
    out = tmp_path / "run"
    broken = failing(Simulation.measure, RuntimeError("lost"), after=LAST + 1)
    monkeypatch.setattr(Simulation, "measure", broken)
    with pytest.raises(SystemExit) as end:
        cli.main(["run", str(small_scene), "--out", str(out), "--no-film"])
    said = capsys.readouterr().err.splitlines()[-1]
    assert end.value.code == 1
    assert said.startswith("flowborne: a fault of flowborne (RuntimeError: lost, in")
    assert said.endswith(message_of(out))


LOST = [("history.csv", "failed"), ("states", "not_written")]


@pytest.mark.parametrize(("name", "outcome"), LOST)
def test_a_run_that_loses_its_files_on_the_way_has_the_true_status(
    small_scene, tmp_path, name, outcome
):
    def take(news):
        if news.frame == LAST:
            (tmp_path / "run" / name).rename(tmp_path / "taken")

    result = run(small_scene, tmp_path / "run", progress=take)
    summary = summary_of(tmp_path / "run")
    assert (summary["outcome"], summary["message"]) == (outcome, result.message)
    assert result.outcome is RunOutcome[outcome.upper()]
    assert "No such file" in result.message


def test_an_export_without_memory_is_no_end_of_a_run(small_scene, tmp_path, monkeypatch):
    def refuse(*given):
        raise MemoryError

    text = small_scene.read_text() + '[[output.exports]]\nfile = "table.csv"\n'
    small_scene.write_text(text)
    monkeypatch.setattr("flowborne.formats.exporting.export", refuse)
    result = run(small_scene, tmp_path / "run")
    assert result.outcome is RunOutcome.DONE
    assert result.message.endswith("; no table.csv: the memory is full")
    summary = summary_of(tmp_path / "run")
    assert (summary["outcome"], summary["message"]) == ("done", result.message)


def test_a_start_that_fails_leaves_no_folder(small_scene, tmp_path, monkeypatch):
    def refuse(*given, **options):
        raise MemoryError

    monkeypatch.setattr(running, "write_model", refuse)
    with pytest.raises(MemoryError):
        run(small_scene, tmp_path / "run")
    assert not (tmp_path / "run").exists()


def refused(number):
    """A function that the system refuses by an error of a number."""

    def refuse(*given, **options):
        raise OSError(number, os.strerror(number))

    return refuse


REFUSED = {
    "the mark": (run_folder, "write_json", errno.EROFS, "readable and writable"),
    "the scene": (save, "write_atomically", errno.ENOSPC, "make room"),
    "the history": (History, "reopen", errno.EACCES, "readable and writable"),
    "the checkpoint": (checkpoint, "read_arrays", errno.EACCES, "readable and writable"),
    "states": (RunFolder, "drop_states_after", errno.EROFS, "readable and writable"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_a_run_that_the_disc_refuses_to_resume_is_not_to_be_replaced(
    small_scene, tmp_path, monkeypatch, what
):
    place, function, number, remedy = REFUSED[what]
    out = tmp_path / "run"
    run(small_scene, out, frames=LAST)
    before, summary = numbers(out), summary_of(out)
    with monkeypatch.context() as patch:
        patch.setattr(place, function, refused(number))
        with pytest.raises(RunFolderError, match=f"cannot be resumed: .*{remedy}, then") as said:
            run(small_scene, out, resume=True)
    assert "--replace" not in str(said.value)
    assert (numbers(out), summary_of(out)) == (before, summary)
    assert run(small_scene, out, resume=True, frames=FRAMES).outcome is RunOutcome.DONE


@pytest.mark.parametrize("name", ["scene.toml", "summary.json", "states/000003.npz"])
def test_a_file_that_may_not_be_read_is_not_to_be_removed(small_scene, tmp_path, monkeypatch, name):
    out = tmp_path / "run"
    run(small_scene, out, frames=LAST)

    def refusing(function):
        def refuse(path, *flags):
            if str(path) == str(out / name):
                raise PermissionError(errno.EACCES, "Permission denied", str(path))
            return function(path, *flags)

        return refuse

    monkeypatch.setattr(given.os, "open", refusing(os.open))
    monkeypatch.setattr(states, "check_file", refusing(given.check_file))
    with pytest.raises(RunFolderError, match=r"cannot be read.*make (it|them) readable") as said:
        run(small_scene, out, resume=True)
    assert "--replace" not in str(said.value)
    assert "remove" not in str(said.value)


def test_a_disc_without_room_for_a_summary_has_the_true_status(small_scene, tmp_path, monkeypatch):
    """As /dev/full does: nothing new can be written, and what is there keeps its blocks."""
    out = tmp_path / "run"

    def fill(news):
        if news.frame == LAST:
            full = refused(errno.ENOSPC)
            monkeypatch.setattr(recorder, "write_atomically", full)
            monkeypatch.setattr(checkpoint, "write_atomically", full)
            monkeypatch.setattr(run_folder, "write_json", full)

    result = run(small_scene, out, progress=fill)
    summary = summary_of(out)
    assert (summary["outcome"], summary["message"]) == ("not_written", result.message)
    assert f"{LAST} is kept, but its checkpoint could not be written" in result.message
    assert RunFolder(out).model_files()
    monkeypatch.undo()
    assert run(small_scene, out, resume=True).outcome is RunOutcome.DONE
    run(small_scene, tmp_path / "whole")
    assert numbers(out) == numbers(tmp_path / "whole")


def test_an_ended_mark_that_does_not_fit_leaves_the_earlier_one(tmp_path, monkeypatch):
    folder = RunFolder.create(tmp_path / "run")
    before = folder.summary.read_bytes()
    with monkeypatch.context() as patch:
        patch.setattr(run_folder, "open", Short, raising=False)
        with pytest.raises(OSError, match="No space left"):
            folder.mark_ended("not_written", "x" * 10_000)
    assert folder.summary.read_bytes() == before


class Short:
    """A file of which a disc takes the first 4096 bytes."""

    def __init__(self, *given, **options):
        self.file = open(*given, **options)  # noqa: SIM115

    def __enter__(self):
        return self

    def __exit__(self, *raised):
        self.file.close()

    def write(self, content):
        return self.file.write(content[:4096])

    def __getattr__(self, name):
        return getattr(self.file, name)
