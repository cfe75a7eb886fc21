"""29.97 frames per second: keys of the exported file are at the seconds of their frames."""

import json
import struct

from blender.character import export_character, reaction_of

from stage import FOLDER, bpy, character, new_scene, select

scene = new_scene(1, 31)
scene.render.fps, scene.render.fps_base = 30, 1.001
rig = character()
select(rig, "tail")
reaction = reaction_of(bpy.context, rig, rig.flowborne)
assert abs(reaction.rate - 30.0 / 1.001) < 1e-5
assert reaction.frames == 30
export_character(bpy.context, rig, FOLDER / "c.glb", 1, 31)
assert scene.render.fps_base == bpy.context.scene.render.fps_base
assert abs(scene.render.fps_base - 1.001) < 1e-6
content = (FOLDER / "c.glb").read_bytes()
(length,) = struct.unpack_from("<I", content, 12)
document = json.loads(content[20 : 20 + length])
(clip,) = document["animations"]
for sampler in clip["samplers"]:
    times = document["accessors"][sampler["input"]]
    assert times["count"] == 31
    assert abs(times["max"][0] - times["min"][0] - 1.001) < 1e-5
