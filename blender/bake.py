# SPDX-License-Identifier: GPL-3.0-or-later
"""A run as a new action with a slot of its own, on the NLA above what animates the armature."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import bpy
import numpy as np
from mathutils import Euler, Matrix

from .character import TRACK, check_armature
from .motion import (
    Array,
    Motion,
    MotionError,
    axes_only,
    basis,
    keys_within,
    same_side,
    shift,
    turns,
)


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

    Each bone gets rotations in its own rotation mode, and a location if it has no parent, so that
    its axes in the world are those of the run in every frame. The active action is moved to a strip
    below, where it plays as before; its keys do not change.

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
    frames = first + np.arange(len(motion.position), dtype=np.float64)
    before = _Before(context, armature, frames, bones)
    action = bpy.data.actions.new(f"{TRACK} {armature.name}")
    slot = action.slots.new(id_type="OBJECT", name=armature.name)
    layer = action.layers.new("Layer")
    bag = layer.strips.new(type="KEYFRAME").channelbag(slot, ensure=True)
    for name in bones:
        bone = armature.pose.bones[name]
        above, rest_above = before.above(bone, motion, bones)
        rest = np.array(bone.bone.matrix_local)
        position, rotation = motion.of(name)
        turned = basis(rotation, above, axes_only(rest), rest_above)
        path, values = _rotations(bone.rotation_mode, turned, before.started[name])
        kept = [*range(len(frames))]
        if tolerance > 0.0:
            kept = keys_within(values, partial(_quaternions, bone.rotation_mode), tolerance)
        _add_curves(bag, bone, path, frames[kept], values[kept])
        if bone.parent is None:
            location = shift(position / unit, before.places, axes_only(rest), rest[:3, 3])
            _add_curves(bag, bone, "location", frames, location)
    _push_down(data, int(frames[0]), int(frames[-1]))
    track = data.nla_tracks.new()
    track.name = action.name
    strip = _add_strip(track, action, slot, float(frames[0]), float(frames[-1]))
    strip.extrapolation = "NOTHING"
    data.use_nla = True
    return strip


class _Before:
    """The armature as it is animated before the bake.

    places   (frames, 4, 4) its axes to the world's
    started  bone -> its rotation in its rotation mode, in the first frame
    """

    def __init__(self, context: Any, armature: Any, frames: Array, bones: Sequence[str]) -> None:
        pose, scene = armature.pose.bones, context.scene
        parents = {pose[name].parent for name in bones} - {None}
        self._parents: dict[str, list[Array]] = {
            bone.name: [] for bone in parents if bone.name not in bones
        }
        places, current = [], scene.frame_current
        for frame in frames.tolist():
            scene.frame_set(int(frame))
            places.append(np.array(armature.matrix_world))
            for name, found in self._parents.items():
                found.append(np.array(armature.matrix_world @ pose[name].matrix))
            if frame == frames[0]:
                self.started = {name: _rotation_of(pose[name]) for name in bones}
        scene.frame_set(current)
        self.places = np.array(places)

    def above(self, bone: Any, motion: Motion, bones: Sequence[str]) -> tuple[Array, Array]:
        """Axes of a bone's parent to the world's (frames, 3, 3), and to the armature's at rest."""
        parent = bone.parent
        if parent is None or not bone.bone.use_inherit_rotation:
            return axes_only(self.places), np.eye(3)
        rest = axes_only(np.array(parent.bone.matrix_local))
        if parent.name in bones:
            return motion.of(parent.name)[1], rest
        return axes_only(np.array(self._parents[parent.name])), rest


def _rotation_of(bone: Any) -> Any:
    """A copy of the rotation of a pose bone; None for an axis and angle."""
    if bone.rotation_mode == "AXIS_ANGLE":
        return None
    quaternion = bone.rotation_mode == "QUATERNION"
    return (bone.rotation_quaternion if quaternion else bone.rotation_euler).copy()


def _rotations(mode: str, turned: Array, start: Any) -> tuple[str, Array]:
    """Property of a rotation mode, and its values (frames, 3 or 4), without flips.

    turned  (frames, 3, 3)
    start   rotation before the first frame, to which the values are near
    """
    matrices = [Matrix(matrix.tolist()) for matrix in turned]
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


def _add_curves(bag: Any, bone: Any, path: str, frames: Array, values: Array) -> None:
    """Keys of a property of a bone: a curve for each column of values (frames, k)."""
    for index, column in enumerate(values.T):
        curve = bag.fcurves.new(bone.path_from_id(path), index=index, group_name=bone.name)
        curve.keyframe_points.add(len(frames))
        curve.keyframe_points.foreach_set("co", np.column_stack([frames, column]).ravel())
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR"
        curve.update()


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
