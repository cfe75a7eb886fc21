"""Ink in a simulated flow becomes a volume in the place and the frames of the run. Real engine."""

import os
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from blender.character import ink_of, reaction_of
from blender.ink import add_ink
from blender.jobs import start_job
from blender.operators import FlowborneInk
from blender.process import JobError, State
from blender.reaction import ReactionError

from stage import FOLDER, Matrix, bpy, character, message, new_scene, select

UNIT = 0.5

scene = new_scene(11, 13)
scene.unit_settings.scale_length = UNIT
rig = character()
bpy.ops.object.empty_add()
rig.flowborne.ink = bpy.context.object
select(rig, "tail")
assert reaction_of(bpy.context, rig, rig.flowborne).ink == ()  # the flow is not simulated
rig.flowborne.simulated, rig.flowborne.resolution = True, 16
assert "has no volume" in message(ReactionError, ink_of, rig.flowborne, UNIT)
bpy.ops.mesh.primitive_cube_add(size=0.4, location=(0.3, 0.6, 1.3))
rig.flowborne.ink = bpy.context.object
bpy.context.object.hide_set(True)
select(rig, "tail")
rig.flowborne.flow = 0.0, 0.5, 0.0
rig.flowborne.preroll = 1
job = start_job(bpy.context, os.environ["FLOWBORNE_ENGINE"])
assert np.abs(np.array(job.reaction.ink) - [(0.05, 0.2, 0.55), (0.25, 0.4, 0.75)]).max() < 1e-6
assert "in progress" in message(JobError, job.start_export)


def watch() -> str:
    """Look after the job as its operator does; returns what was reported."""
    reported, manager = [], bpy.context.window_manager
    operator = SimpleNamespace(
        _job=job,
        _armature="",
        _timer=manager.event_timer_add(1.0, window=bpy.context.window),
        report=lambda kind, text: reported.append(text),
    )
    until = time.monotonic() + 500.0
    while not reported:
        FlowborneInk.modal(operator, bpy.context, SimpleNamespace(type="TIMER"))
        assert time.monotonic() < until
        time.sleep(0.05)
    return reported[0]


assert watch() == "done, frame 3/3", job.message
job.reaction = replace(job.reaction, ink=())
assert "has no ink" in message(JobError, job.start_export)
job.reaction = type(job.reaction).load(job.folder / "job.json")
job.start_export()
job.cancel()
said = watch()
assert said == "cancelled, frame 3/3", said
assert not bpy.data.volumes
job.start_export()
assert job.state is State.EXPORTING
said = watch()
assert said == "volumes written, frame 3/3", said


def check() -> None:
    """Frame 10 shows the first file, and the volume is where the domain of the run is."""
    (volume,) = bpy.data.volumes
    (thing,) = (each for each in bpy.data.objects if each.type == "VOLUME")
    assert volume.filepath.startswith("//shot-flowborne")
    assert volume.grids.load()
    assert volume.velocity_grid == "velocity"
    assert {"dye", "velocity"} <= {grid.name for grid in volume.grids}
    assert thing.active_material.node_tree.nodes["Principled Volume"]
    for frame in (10, 11, 13):
        bpy.context.scene.frame_set(frame)
        drawn = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
        drawn.data.grids.load()
        assert Path(drawn.data.grids.frame_filepath).name == f"flow_{frame - 10:04}.vdb"
        corners = np.array([drawn.matrix_world @ Matrix.Translation(c) for c in drawn.bound_box])
        low, high = corners[:, :3, 3].min(axis=0), corners[:, :3, 3].max(axis=0)
        box = np.array(job.reaction.ink) / UNIT
        assert (low < box[0] + 0.2).all(), (low, high)
        assert (high > box[1] - 0.2).all(), (low, high)
        assert (high - low < 20.0).all()


check()
bpy.ops.wm.save_mainfile()
bpy.ops.wm.open_mainfile(filepath=str(FOLDER / "shot.blend"))
check()
bpy.data.volumes.remove(bpy.data.volumes[0])
job.reaction = replace(job.reaction, loop=True, lead=1)
volume = add_ink(bpy.context, job).data
assert (volume.frame_start, volume.frame_offset, volume.frame_duration) == (11, 0, 3)
