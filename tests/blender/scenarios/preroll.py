"""A pre-roll starts the run before the range, and is not baked. With the real engine."""

import os
import time

import numpy as np
from blender.character import reaction_of
from blender.jobs import start_job
from blender.process import IDLE, State
from blender.reaction import ReactionError

from stage import (
    BONES,
    animation,
    bake,
    bpy,
    character,
    curves,
    message,
    new_scene,
    refusal,
    select,
)

scene = new_scene(1, 16)
rig = character()
scene.frame_start = 11
select(rig, "tail")
rig.flowborne.preroll = 12
said = message(ReactionError, reaction_of, bpy.context, rig, rig.flowborne)
assert "12 frames does not fit before frame 11" in said
rig.flowborne.preroll = 8
job = start_job(bpy.context, os.environ["FLOWBORNE_ENGINE"])
assert (scene.frame_start, scene.frame_end) == (11, 16)
assert (job.reaction.first, job.reaction.lead, job.reaction.frames) == (11, 8, 13)
until = time.monotonic() + 300.0
while job.step() not in IDLE:
    time.sleep(0.02)
    assert time.monotonic() < until
assert job.state is State.DONE, job.message
strip = bake(rig)
for keys in curves(strip.action).values():
    assert [frame for frame, _ in keys] == [11.0, 12.0, 13.0, 14.0, 15.0, 16.0]
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
