"""The real engine: flesh around bones that follow the animation reacts, and moves the mesh."""

import os
import time

import numpy as np
from blender.jobs import start_job
from blender.motion import read_skin
from blender.process import IDLE, State
from mathutils.bvhtree import BVHTree

from stage import bpy, character, new_scene, place, select, shown

scene = new_scene(11, 14)
rig = character()
place(rig)
body = bpy.data.objects["rig body"]
select(rig, "tail", "tip")
rig.flowborne.flesh, rig.flowborne.stiffness, rig.flowborne.preroll = "FOLLOW", 2000.0, 1
job = start_job(bpy.context, os.environ["FLOWBORNE_ENGINE"])
until = time.monotonic() + 400.0
while job.step() not in IDLE:
    time.sleep(0.05)
    assert time.monotonic() < until
assert job.state is State.DONE, job.message
rigid = {frame: shown(body, frame) for frame in range(11, 15)}
assert bpy.ops.flowborne.flesh() == {"FINISHED"}

# Elements of flesh cut the edges of the box. A vertex keeps its distance from the element that it
# moves with, and another one may come closer.
tail = np.array([vertex.co.y for vertex in body.data.vertices]) > 1.0
skin = read_skin(job.run, 1)
for k, vertices in enumerate(skin.vertices):
    tree = BVHTree.FromPolygons(vertices.tolist(), skin.triangles.tolist())
    points = shown(body, 11 + k)
    away = np.array([tree.find_nearest(point)[3] for point in points[tail].tolist()])
    assert away.max() < 0.05
    if k == 0:
        first = away
    assert (away - first).max() < 5e-3
    moved = np.linalg.norm(points - rigid[11 + k], axis=1)
    assert moved[tail].max() > 0.01
    assert moved[np.array([vertex.co.y for vertex in body.data.vertices]) < 0.7].max() < 1e-5
