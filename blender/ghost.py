# SPDX-License-Identifier: GPL-3.0-or-later
"""A copy of a character that plays the frames of a run while they are computed.

It is drawn as wires, cannot be selected, and is not rendered. It is never saved, and is removed
when its job ends.
"""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from bpy.app.handlers import persistent

from .character import meshes_of
from .job import Job
from .jobs import JOBS
from .motion import MotionError, read_motion
from .reaction import ReactionError
from .stand_in import parents_of, play, remove, stand_in

GHOST = "flowborne ghost"
"""Name of ghosts, and of the property that holds the folder of their job."""


def show_ghost(context: Any, armature: Any, job: Job) -> None:
    """Let the ghost of a job play the frames so far; of a cycle those of the last round.

    There is none while the run has no frame, or the character has changed since.
    """
    done, reaction = job.frames_done, job.reaction
    length = reaction.frames - reaction.lead if reaction.loop else reaction.frames + 1
    start = done // length * length
    first = reaction.first - (start if reaction.loop else reaction.lead)
    ghost = next((each for each in _ghosts(job) if each.type == "ARMATURE"), None)
    if ghost is not None and ghost["start"] != start:
        remove(_ghosts(job))
        context.view_layer.update()
        ghost = None
    shown = start if ghost is None else start + _keys(ghost)
    if shown > done:
        return
    try:
        motion = read_motion(job.run, shown)
        if ghost is None and parents_of(armature.data.bones).keys() <= {*motion.names}:
            ghost = _new(context, armature, job, start)
    except (MotionError, ReactionError):
        return
    if ghost is not None:
        places = np.tile(np.array(ghost.matrix_world), (len(motion.position), 1, 1))
        poses = {
            bone.name: places @ motion.in_armature(bone.name, reaction.unit, places)
            for bone in ghost.data.bones
        }
        play(ghost, range(first + shown, first + shown + len(places)), poses)
        ghost.animation_data.action.is_runtime_data = True


def remove_ghosts(job: Job) -> None:
    """Remove the ghost of a job."""
    remove(_ghosts(job))


@persistent
def remove_stale(*_: Any) -> None:
    """Remove ghosts whose job has ended, which an undo brings back."""
    running = {folder for folder, job in JOBS.items() if job.active}
    remove(each for each in bpy.data.objects if each.get(GHOST, "") not in ("", *running))


def _ghosts(job: Job) -> list[Any]:
    """The objects of a job's ghost, which an undo may have replaced or removed."""
    return [each for each in bpy.data.objects if each.get(GHOST) == str(job.folder)]


def _keys(ghost: Any) -> int:
    """Number of frames that a ghost plays."""
    bag = ghost.animation_data.action.layers[0].strips[0].channelbags[0]
    return len(bag.fcurves[0].keyframe_points)


def _new(context: Any, armature: Any, job: Job, start: int) -> Any:
    """A ghost in the scene, without frames."""
    with stand_in(context, armature, meshes_of(context, armature), GHOST) as (copy, scene):
        copy["start"] = start
        for each in scene.objects:
            each[GHOST] = str(job.folder)
            each.display_type, each.hide_select, each.hide_render = "WIRE", True, True
            each.is_runtime_data = True
            context.scene.collection.objects.link(each)
        copy.data.is_runtime_data = True
    return copy
