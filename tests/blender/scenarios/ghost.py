"""A ghost plays the frames so far. It is not saved, and ends with its job, also after an undo."""

import shutil
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from blender.jobs import JOBS, job_of
from blender.motion import read_motion
from blender.operators import FlowborneRun
from blender.process import State

from stage import (
    BONES,
    CLOSE,
    FOLDER,
    animation,
    bpy,
    character,
    new_scene,
    place,
    recorded,
    select,
)

FRAMES = 12

new_scene()
rig = character()
place(rig)
run = recorded(rig)
select(rig, "tail")
bpy.ops.object.mode_set(mode="POSE")
job = job_of(rig.flowborne, "")
job.step = lambda: job.state
shutil.copytree(run / "states", FOLDER / "later")


def frames(count: int) -> None:
    """Let the run have this many frames."""
    for k in range(FRAMES):
        path = run / "states" / f"{k:06}.npz"
        path.unlink(missing_ok=True)
        if k < count:
            shutil.copy(FOLDER / "later" / path.name, path)


def tick() -> None:
    """What the operator does twice a second."""
    manager = bpy.context.window_manager
    operator = SimpleNamespace(
        _job=job,
        _armature="rig",
        _timer=manager.event_timer_add(1.0, window=bpy.context.window),
        report=lambda kind, text: None,
    )
    FlowborneRun.modal(operator, bpy.context, SimpleNamespace(type="TIMER"))


def ghosts():
    return [each for each in bpy.data.objects if each.name.startswith("flowborne ghost")]


def data():
    return {
        key: len(getattr(bpy.data, key)) for key in ("objects", "meshes", "armatures", "actions")
    }


def check(count: int) -> None:
    """The ghost has this many frames, as in the run."""
    ghost = next(each for each in ghosts() if each.type == "ARMATURE")
    motion, (position, rotation) = read_motion(run), animation(ghost)
    for name in BONES:
        n = ghost.pose.bones.find(name)
        places, axes = motion.of(name)
        assert np.abs(axes - rotation[:count, n]).max() < CLOSE
        assert np.abs(places - position[:count, n]).max() < 2.5 * CLOSE
    (curve, *_) = ghost.animation_data.action.layers[0].strips[0].channelbags[0].fcurves
    assert len(curve.keyframe_points) == count


before = data()
frames(1)
job.state = State.IMPORTING
tick()
assert not ghosts()
job.state = State.RUNNING
for count in (1, 4, 9):
    frames(count)
    tick()
    check(count)
assert (bpy.context.object, rig.mode, bpy.context.selected_objects) == (rig, "POSE", [rig])
assert {each.name for each in ghosts()} == {"flowborne ghost"}
(skin,) = (each for each in bpy.data.objects if each.type == "MESH" and each.hide_render)
assert skin.hide_select
assert skin.modifiers["Armature"].object.name == "flowborne ghost"

bpy.ops.ed.undo_push(message="with a ghost")
bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "saved.blend"), copy=True)
with bpy.data.libraries.load(str(FOLDER / "saved.blend")) as (saved, _):
    assert {*saved.objects} == {"rig", "rig body"}
    assert [*saved.armatures] == ["rig"]
    assert not any("ghost" in name for name in saved.actions)

job.state = State.CANCELLED
tick()
assert data() == before
rig.location.x += 1.0
bpy.ops.ed.undo_push(message="moved")
bpy.ops.ed.undo()
rig = bpy.data.objects["rig"]
assert data() == before, "the undo brought the ghost back"

job.state = State.RUNNING
JOBS[str(job.folder)] = job
tick()
check(9)
bpy.ops.ed.undo_push(message="again")
rig.location.x += 1.0
bpy.ops.ed.undo_push(message="moved")
bpy.ops.ed.undo()
check(9)
frames(12)
tick()
check(12)

job.reaction = replace(job.reaction, frames=8, lead=4, loop=True)  # two rounds of 4 frames
frames(3)
tick()
frames(7)
tick()
ghost = next(each for each in ghosts() if each.type == "ARMATURE")
axes, shown = read_motion(run).of("tip")[1][4:7], animation(ghost)[1]
assert np.abs(axes - shown[:3, ghost.pose.bones.find("tip")]).max() < CLOSE

bpy.data.objects["rig"].data.bones["tip"].name = "renamed"
for each in ghosts():
    bpy.data.objects.remove(each)
bpy.context.view_layer.update()
tick()  # the character has changed: there is no ghost, and no error
assert not ghosts()
job.state = State.DONE
tick()
