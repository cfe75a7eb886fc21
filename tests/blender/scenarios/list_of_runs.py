"""The runs of an armature are listed, one is chosen, and a new run takes a free number."""

import shutil
import time
from pathlib import Path
from types import SimpleNamespace

from blender.jobs import folders_of, job_of, start_job
from blender.panel import FlowborneRunsPanel

from stage import FOLDER, bpy, character, new_scene, recorded, select

new_scene()
rig = character()
other = character("rig-2")
above = FOLDER / "shot-flowborne"
for number in (1, 3, 10):
    recorded(rig, called=f"shot-flowborne/rig-{number}")
recorded(other, called="shot-flowborne/rig-2-1")
(above / "rig-4").mkdir()
(above / "rig-10" / "run" / "states" / "000011.npz").unlink()
select(rig)
assert [*folders_of(rig)] == [1, 3, 4, 10]
assert [*folders_of(other)] == [1]
shown = []


def operator(name, text, depress):
    shown.append((text, depress))
    return SimpleNamespace()


layout = SimpleNamespace(operator=operator, label=lambda text, icon: shown.append((text, icon)))
bpy.ops.flowborne.choose(number=3)
assert Path(bpy.path.abspath(rig.flowborne.folder)) == above / "rig-3"
assert job_of(rig.flowborne, "").folder == above / "rig-3"
FlowborneRunsPanel.draw(SimpleNamespace(layout=layout), bpy.context)
assert shown[0] == ("rig-1: done, frame 11/11", False)
assert shown[1] == ("rig-3: done, frame 11/11", True)
assert "rig-4/job.json cannot be read" in shown[2][0]
assert shown[3] == ("rig-10: cancelled, frame 10/11", False)
shutil.rmtree(above / "rig-1")
select(rig, "tail")
python = FOLDER / "python"
python.write_text("#!/bin/sh\nexit 1\n")
python.chmod(0o755)
job = start_job(bpy.context, str(python))
until = time.monotonic() + 60.0
while job_of(
    rig.flowborne, ""
).active:  # looked after by the panel, as after another file is opened
    assert time.monotonic() < until
assert job.line == "it ended with code 1"
assert job.folder == above / "rig-11"
assert rig.flowborne.folder == "//shot-flowborne/rig-11"
