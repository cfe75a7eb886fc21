"""Make Environment: venv and pip as a job, online only, cancelled and made again."""

import os
import sys
import time
import zipfile
from pathlib import Path
from types import SimpleNamespace

from stage import FOLDER, bpy, install_extension, message

NAME = install_extension()
environment, jobs, operators, process = (
    sys.modules[f"{NAME}.{module}"] for module in ("environment", "jobs", "operators", "process")
)
preferences = bpy.context.preferences.addons[NAME].preferences
shown = []
del os.environ["PYTHONPATH"]  # the environment has a flowborne of its own


def start():
    return jobs.start_install(bpy.context)


def refused() -> str:
    return message(process.JobError, start)


def finish(job) -> str:
    """Look after a job as the operator does, until it ends; returns what was reported."""
    reported, manager = [], bpy.context.window_manager
    operator = SimpleNamespace(
        _job=job,
        _timer=manager.event_timer_add(1.0, window=bpy.context.window),
        report=lambda kind, text: reported.append(text),
    )
    until = time.monotonic() + 120.0
    while operators.FlowborneInstall.modal(
        operator, bpy.context, SimpleNamespace(type="TIMER")
    ) != {"FINISHED"}:
        shown.append(job.line)
        assert time.monotonic() < until
        time.sleep(0.05)
    return reported[0]


def wheel(main: str, more: str = "") -> Path:
    """A wheel of a flowborne that does this, with more metadata."""
    path = FOLDER / "flowborne-1.0-py3-none-any.whl"
    about = "flowborne-1.0.dist-info"
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("flowborne/__main__.py", main)
        metadata = f"Metadata-Version: 2.1\nName: flowborne\nVersion: 1.0\n{more}"
        file.writestr(f"{about}/METADATA", metadata)
        file.writestr(f"{about}/WHEEL", "Wheel-Version: 1.0\nTag: py3-none-any\n")
        file.writestr(f"{about}/RECORD", "")
    return path


bpy.context.preferences.system.use_online_access = False
assert "online access is off" in refused()
bpy.context.preferences.system.use_online_access = True
for nothing in ("", str(FOLDER), str(FOLDER / "none.whl")):
    preferences.source = nothing
    assert "is no folder and no wheel of flowborne" in refused()
preferences.source = str(wheel("print('flowborne 1.0')"))
environment.OLDEST = 4, 0
assert "flowborne needs 4.0 or later" in refused()
environment.OLDEST = 3, 11

job = start()
assert job.active
assert "a job is in progress" in refused()
bpy.ops.flowborne.cancel(folder=str(job.folder))
assert finish(job) == "cancelled"
assert not preferences.engine

assert start() is job
assert finish(job) == "done"
assert preferences.engine == str(job.folder)
assert environment.engine_command(preferences.engine)[1:] == ("-m", "flowborne")
for said in ("making an environment", "installing flowborne: ", "starting flowborne"):
    assert any(line.startswith(said) for line in shown), (said, {*shown})

wheel("", "Requires-Python: <3\n")
preferences.engine = ""
said = finish(start())
assert said.startswith("installing flowborne failed; all that was printed is in"), said
assert "requires a different Python" in said, said
assert not preferences.engine
assert start().active
bpy.ops.preferences.addon_disable(module=NAME)  # as at the end of Blender
assert not job.active
