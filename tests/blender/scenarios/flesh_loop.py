"""Flesh of a cycle that travels: the last round is shown where the first one starts."""

import json

import numpy as np
from blender.motion import read_motion

from stage import (
    CLOSE,
    JOINTS,
    add_skin,
    bake,
    bpy,
    character,
    new_scene,
    recorded,
    select,
    shown,
    skin_of,
)

LEAD = 4

new_scene(1, 12)
rig = character()
run = recorded(rig)
own = add_skin(rig, run)
job = run.parent / "job.json"
job.write_text(json.dumps(json.loads(job.read_text()) | {"loop": True, "lead": LEAD}))
select(rig)
assert bpy.ops.flowborne.flesh() == {"FINISHED"}
bake(rig, "ALL")
turn, shift = read_motion(run).back(LEAD)
assert np.linalg.norm(shift) > 0.05
for k in range(12 - LEAD):
    expected = skin_of(run, LEAD + k) @ turn.T + shift
    apart = np.abs(shown(bpy.data.objects["rig body"], 1 + k)[own] - expected).max()
    assert apart < CLOSE * JOINTS[-1], f"frame {k}: {apart:.2g} apart"
