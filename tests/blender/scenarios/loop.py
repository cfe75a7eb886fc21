"""A cycle is run in rounds, and the last is baked where the first was. With the real engine."""

import math
import os
import time

import numpy as np
from blender.character import reaction_of
from blender.jobs import start_job
from blender.motion import read_motion
from blender.process import IDLE, State
from blender.reaction import ReactionError
from mathutils import Euler

from stage import BONES, animation, bake, bpy, character, curves, message, new_scene, select

PERIOD = 12

scene = new_scene(1, 1 + PERIOD)
rig = character()
rig.animation_data_clear()
for frame in range(1, 2 + PERIOD):
    phase = 2.0 * math.pi * (frame - 1) / PERIOD
    for number, bone in enumerate(rig.pose.bones):
        turn = Euler((0.3 * math.sin(phase + number), 0.0, 0.2 * math.cos(phase)))
        bone.rotation_quaternion = turn.to_quaternion()
        bone.keyframe_insert("rotation_quaternion", frame=frame)
    rig.pose.bones[0].location = 0.05 * (frame - 1), 0.0, 0.1 * math.sin(phase)
    rig.pose.bones[0].keyframe_insert("location", frame=frame)
select(rig, "tail")
rig.flowborne.rounds, rig.flowborne.preroll = 3, 7
rig.flowborne.floats = True
assert "leaves the cycle" in message(ReactionError, reaction_of, bpy.context, rig, rig.flowborne)
rig.flowborne.floats = False
job = start_job(bpy.context, os.environ["FLOWBORNE_ENGINE"])
assert (job.reaction.first, job.reaction.lead, job.reaction.frames) == (1, 24, 36)
until = time.monotonic() + 300.0
while job.step() not in IDLE:
    time.sleep(0.02)
    assert time.monotonic() < until
assert job.state is State.DONE, job.message
whole = read_motion(job.run)
last = whole.after(24, loop=True)
first = whole.of("trunk")
assert np.abs(first[0][24] - first[0][0]).max() > 0.5  # the character has walked on
for n, found in enumerate(last.of("trunk")):
    assert np.abs(found - first[n][: PERIOD + 1]).max() < 1e-4
free = np.swapaxes(whole.of("trunk")[1], 1, 2) @ whole.of("tail")[1]
assert np.abs(free[24] - free[0]).max() > 0.02  # settles in the first rounds
apart = last.ends_apart(["tail"])
assert apart < 0.5 * whole.ends_apart(["tail"]), (apart, whole.ends_apart(["tail"]))
strip = bake(rig)
assert {len(keys) for keys in curves(strip.action).values()} == {PERIOD + 1}
n = BONES.index("tail")
assert np.abs(animation(rig)[1][:, n] - last.of("tail")[1]).max() < 1e-5
