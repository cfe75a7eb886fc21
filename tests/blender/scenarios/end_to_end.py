"""The real engine: a tail in simple wind, cancelled and resumed, then baked."""

import os
import time
from pathlib import Path

import numpy as np
from blender.jobs import start_job
from blender.process import IDLE, State

from stage import bake, bpy, character, check_equal, new_scene, place, select

scene = new_scene(11, 34)
scene.render.fps, scene.render.fps_base = 30, 1.001
rig = character()
place(rig)
select(rig, "tail", "tip")
bpy.ops.object.effector_add(type="WIND", rotation=(0.0, 1.57, 0.0))
rig.flowborne.wind = bpy.context.object
rig.flowborne.wind.field.strength = 8.0
select(rig, "tail", "tip")
began = time.monotonic()
job = start_job(bpy.context, os.environ["FLOWBORNE_ENGINE"])


def finish() -> None:
    while job.step() not in IDLE:
        time.sleep(0.02)
        assert time.monotonic() - began < 300.0


while job.frames_done < 3:
    assert job.step() not in IDLE, job.message
    time.sleep(0.005)
job.cancel()
finish()
if job.state is State.CANCELLED:  # else it was done before the child could stop
    assert 3 <= job.frames_done < 23
    job.start()
    finish()
assert job.state is State.DONE, job.message
assert job.frames_done == 23
run = Path(bpy.path.abspath(rig.flowborne.folder)) / "run"
with np.load(run / "states" / "000000.npz") as state:
    scene.frame_set(11)
    first = np.array(rig.matrix_world @ rig.pose.bones["tip"].matrix)
    assert np.abs(state["body_rotation"][3] - first[:3, :3] / 2.5).max() < 1e-3
    assert np.abs(state["body_position"][3] - first[:3, 3]).max() < 1e-3
bake(rig)
check_equal(rig, run, ("tail", "tip"))
