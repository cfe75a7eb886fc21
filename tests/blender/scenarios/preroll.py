"""A pre-roll starts before the range and frame 0, and is not baked. With the real engine."""

import os
import time

import numpy as np
from blender.jobs import start_job
from blender.motion import read_motion
from blender.process import IDLE, State

from stage import (
    BONES,
    animation,
    bake,
    bpy,
    character,
    curves,
    new_scene,
    refusal,
    select,
    world_of,
)

scene = new_scene(1, 8)
rig = character(first=-9)
scene.frame_start = 3
select(rig, "tail")
rig.flowborne.preroll = 8
scene.frame_set(5, subframe=0.25)
job = start_job(bpy.context, os.environ["FLOWBORNE_ENGINE"])
assert (scene.frame_start, scene.frame_end) == (3, 8)
assert (scene.frame_current, scene.frame_subframe) == (5, 0.25)
assert (job.reaction.first, job.reaction.lead, job.reaction.frames) == (3, 8, 13)
until = time.monotonic() + 300.0
while job.step() not in IDLE:
    time.sleep(0.02)
    assert time.monotonic() < until
assert job.state is State.DONE, job.message
trunk = read_motion(job.run).of("trunk")[1]
for k in (0, 4, 13):  # frames -5, -1 and 8
    scene.frame_set(-5 + k)
    assert np.abs(trunk[k] - world_of(rig)[1][0]).max() < 1e-3, k
strip = bake(rig)
for keys in curves(strip.action).values():
    assert [frame for frame, _ in keys] == [3.0, 4.0, 5.0, 6.0, 7.0, 8.0]
rotation = animation(rig)[1]
for k in range(6):
    with np.load(job.run / "states" / f"{8 + k:06}.npz") as state:
        for name in ("trunk", "tail"):
            n = BONES.index(name)
            close = 1e-5 if name == "tail" else 1e-3
            assert np.abs(state["body_rotation"][n + 1] - rotation[k, n]).max() < close
for path in sorted((job.run / "states").iterdir())[6:]:
    path.unlink()
assert "5 frames, and the bake starts after 8" in refusal(rig)
