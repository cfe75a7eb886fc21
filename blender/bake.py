# SPDX-License-Identifier: GPL-3.0-or-later
"""A run as a new action with a slot of its own, on the NLA above what animates the armature."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np
from mathutils import Euler, Matrix

from .character import TRACK, check_armature, control_of, end_of, in_frames, poses_of
from .keys import add_keys, new_action
from .motion import Array, Motion, MotionError, angles, axes_only, keys_within, same_side, turns

NOTICED = 0.1
"""Degrees from the run above which a bone is reported."""


def bake(
    context: Any,
    armature: Any,
    motion: Motion,
    first: int,
    unit: float,
    bones: Sequence[str],
    tolerance: float = 0.0,
) -> Any:
    """Put the motion of bones on the NLA of an armature, and return the strip.

    Each bone, or the control whose place it copies, gets rotations in its own rotation mode, and a
    location if its parent is no bone of the run, so that its axes in the world are those of the run
    in every frame. The active action is moved to a strip below, where it plays as before; its keys
    do not change.

    first      frame of Blender at which the motion starts
    unit       m per unit of Blender
    tolerance  degrees by which a bone's rotation may differ where keys are left out; 0 keeps all
    raises     MotionError or ReactionError when these bones cannot be baked on this armature
    """
    check_armature(armature)
    motion.check(bones)
    missing = [name for name in bones if name not in armature.pose.bones]
    if missing:
        raise MotionError(
            f"armature '{armature.name}' has no bone '{missing[0]}' of the run: rename it back"
        )
    if not bones:
        raise MotionError("no bone is selected: select bones in Pose Mode, or bake all")
    data = armature.animation_data or armature.animation_data_create()
    if data.use_tweak_mode:
        raise MotionError("a strip of the NLA is in Tweak Mode: leave it (Tab in the NLA editor)")
    pose, frames = armature.pose.bones, range(first, first + len(motion.position))
    controls = {control_of(pose[name]).name: name for name in bones}
    ends = {end: name for name in bones if (end := end_of(pose[name])) and end not in controls}
    controls |= ends
    needed = {each.name for name in controls for each in [pose[name], *pose[name].parent_recursive]}
    places, before = poses_of(context, armature, frames, needed)
    for _ in in_frames(context, frames[:1]):
        started = {name: _rotation_of(pose[name]) for name in controls}
    after = {control: motion.in_armature(name, unit, places) for control, name in controls.items()}
    for end, name in ends.items():
        after[end][:, :3, 3] += after[end][:, :3, 1] * pose[name].bone.length
    action, slot, bag = new_action(f"{TRACK} {armature.name}", armature.name)
    for name in controls:
        bone, above = pose[name], None
        if bone.parent is not None:
            above = before[bone.parent.name]
            carrier = next((b.name for b in bone.parent_recursive if b.name in controls), None)
            if carrier is not None:
                above = after[carrier] @ np.linalg.inv(before[carrier]) @ above
        local = [*_locals(bone, after[name], above)]
        path, values = _rotations(bone.rotation_mode, local, started[name])
        kept = [*range(len(frames))]
        if tolerance > 0.0:
            kept = keys_within(values, partial(_quaternions, bone.rotation_mode), tolerance)
        add_keys(bag, bone, path, [frames[k] for k in kept], values[kept])
        if bone.parent is None or bone.parent.name not in motion.names:
            add_keys(bag, bone, "location", frames, np.array([each.translation for each in local]))
    _push_down(data, frames[0], frames[-1])
    track = data.nla_tracks.new()
    track.name = action.name
    strip = _add_strip(track, action, slot, frames[0], frames[-1])
    strip.extrapolation = "NOTHING"
    data.use_nla = True
    return strip


def turned_away(
    context: Any, armature: Any, motion: Motion, first: int, bones: Sequence[str]
) -> dict[str, float]:
    """Bones that constraints or drivers turn away from the run after a bake -> degrees.

    The first, middle and last frame are examined.
    """
    last = len(motion.position) - 1
    chosen = [0, last // 2, last]
    places, poses = poses_of(context, armature, [first + frame for frame in chosen], bones)
    apart = {
        name: angles(axes_only(places @ poses[name]), motion.of(name)[1][chosen]).max()
        for name in bones
    }
    return {name: float(angle) for name, angle in apart.items() if angle > NOTICED}


def _locals(bone: Any, poses: Array, above: Array | None) -> Iterator[Any]:
    """Matrices of a pose bone relative to its rest pose.

    poses  (frames, 4, 4) its axes to the armature's
    above  (frames, 4, 4) those of its parent; None without one
    """
    rest = bone.bone.matrix_local
    for number, pose in enumerate(poses):
        parent = {}
        if above is not None:
            parent["parent_matrix"] = Matrix(above[number])
            parent["parent_matrix_local"] = bone.parent.bone.matrix_local
        yield bone.bone.convert_local_to_pose(Matrix(pose), rest, **parent, invert=True)


def _rotation_of(bone: Any) -> Any:
    """A copy of the rotation of a pose bone; None for an axis and angle."""
    if bone.rotation_mode == "AXIS_ANGLE":
        return None
    quaternion = bone.rotation_mode == "QUATERNION"
    return (bone.rotation_quaternion if quaternion else bone.rotation_euler).copy()


def _rotations(mode: str, matrices: Sequence[Any], start: Any) -> tuple[str, Array]:
    """Property of a rotation mode, and its values (frames, 3 or 4), without flips.

    start  rotation before the first frame, to which the values are near
    """
    if mode in ("QUATERNION", "AXIS_ANGLE"):
        quaternions = np.array([matrix.to_quaternion() for matrix in matrices])
        if mode == "AXIS_ANGLE":
            return "rotation_axis_angle", turns(quaternions)
        near = same_side(np.concatenate([[np.array(start)], quaternions]))
        return "rotation_quaternion", near[1:]
    eulers = []
    for matrix in matrices:
        start = matrix.to_euler(mode, start)
        eulers.append(np.array(start))
    return "rotation_euler", np.array(eulers)


def _quaternions(mode: str, values: Array) -> Array:
    """Unit quaternions (n, 4) of values (n, 3 or 4) of a rotation mode."""
    if mode == "QUATERNION":
        found = values
    elif mode == "AXIS_ANGLE":
        half, axes = 0.5 * values[:, :1], values[:, 1:]
        axes = axes / np.linalg.norm(axes, axis=1, keepdims=True)
        found = np.hstack([np.cos(half), np.sin(half) * axes])
    else:
        found = np.array([Euler(each, mode).to_quaternion() for each in values.tolist()])
    return np.asarray(found / np.linalg.norm(found, axis=1, keepdims=True))


def _push_down(data: Any, first: int, last: int) -> None:
    """Move the active action to a strip that plays it as before, at least from first to last."""
    action, slot = data.action, data.action_slot
    if action is None:
        return
    start, end = action.curve_frame_range
    track = data.nla_tracks.new()
    track.name = action.name
    strip = _add_strip(track, action, slot, min(start, first), max(end, last))
    strip.extrapolation, strip.blend_type = data.action_extrapolation, data.action_blend_type
    if data.action_influence != 1.0:
        strip.use_animated_influence, strip.influence = True, data.action_influence
    data.action = None


def _add_strip(track: Any, action: Any, slot: Any, start: float, end: float) -> Any:
    """A strip that plays an action at its own frames."""
    strip = track.strips.new(action.name, int(start), action)
    strip.action_slot = slot
    strip.use_sync_length = False
    strip.action_frame_start, strip.action_frame_end = start, end
    strip.frame_start, strip.frame_end = start, end
    strip.use_auto_blend, strip.blend_in, strip.blend_out = False, 0.0, 0.0
    return strip
