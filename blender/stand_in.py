# SPDX-License-Identifier: GPL-3.0-or-later
"""A copy of a character with its deforming bones alone, which plays given poses.

Control bones, constraints, drivers and the NLA stay with the character. So the copy can be exported
from any frame, and shows frames of a run whatever the character does.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

from .keys import add_keys, new_action
from .motion import Array

FLESH = "flowborne flesh"
"""Start of the names of our modifiers, which copies of meshes lack."""

SAME_PLACE = 1e-4
"""Largest difference of rest poses of two bones in the same place, in lengths of the bone."""


def remove_flesh(mesh: Any) -> None:
    """Remove our modifiers from a mesh."""
    for modifier in [each for each in mesh.modifiers if each.name.startswith(FLESH)]:
        mesh.modifiers.remove(modifier)


@contextmanager
def stand_in(
    context: Any, armature: Any, meshes: Iterable[Any], name: str
) -> Iterator[tuple[Any, Any]]:
    """A new armature, at rest where the character is in this frame, with its meshes.

    Gives it and the scene in which they are. This scene is removed at the end of the context, with
    all objects that are in no other one.
    """
    scene, data = bpy.data.scenes.new(name), bpy.data.armatures.new(name)
    copy = bpy.data.objects.new(name, data)
    scene.collection.objects.link(copy)
    copy.matrix_world = armature.matrix_world
    layer = scene.view_layers[0]
    layer.objects.active = copy
    try:
        with context.temp_override(scene=scene, view_layer=layer, object=copy, active_object=copy):
            bpy.ops.object.mode_set(mode="EDIT")
            parents = parents_of(armature.data.bones)
            for bone in armature.data.bones:
                if bone.name in parents:
                    edited = data.edit_bones.new(bone.name)
                    edited.head, edited.tail = bone.head_local, bone.tail_local
                    edited.align_roll(bone.matrix_local.col[2].xyz)
            for each, above in parents.items():
                data.edit_bones[each].parent = data.edit_bones.get(above)
            bpy.ops.object.mode_set(mode="OBJECT")
        for mesh in meshes:
            skin = mesh.copy()
            skin.animation_data_clear()
            skin.constraints.clear()
            skin.parent, skin.parent_type = copy, "OBJECT"
            skin.matrix_parent_inverse = copy.matrix_world.inverted()
            skin.matrix_world = mesh.matrix_world
            remove_flesh(skin)
            modifiers = [each for each in skin.modifiers if each.type == "ARMATURE"]
            for modifier in modifiers or [skin.modifiers.new(name, "ARMATURE")]:
                modifier.object = copy
            scene.collection.objects.link(skin)
        yield copy, scene
    finally:
        remove(each for each in scene.objects if len(each.users_scene) == 1)
        bpy.data.scenes.remove(scene)


def parents_of(bones: Sequence[Any]) -> dict[str, str]:
    """Deforming bone -> the bone that carries it, empty without one.

    It is the nearest bone above that deforms, or in whose place a deforming bone is: rigs with
    control bones (Rigify) have a chain of bones that deform nothing, and one that deforms next to
    it. Without such a bone it is the root of the armature, which is then part of the result.
    """
    deforming = [bone for bone in bones if bone.use_deform]
    found: dict[str, str] = {}
    for bone in deforming:
        carriers = (
            each
            for above in bone.parent_recursive
            for each in ([above] if above.use_deform else deforming)
            if _same_place(each, above) and bone not in (each, *each.parent_recursive)
        )
        root = bone.parent_recursive[-1:]
        carrier = next(carriers, root[0] if root else None)
        found[bone.name] = "" if carrier is None else carrier.name
        if root and carrier == root[0]:
            found.setdefault(carrier.name, "")
    return found


def _same_place(one: Any, other: Any) -> bool:
    apart = np.abs(np.array(one.matrix_local) - np.array(other.matrix_local)).max()
    return bool(apart <= SAME_PLACE * other.length)


def play(copy: Any, frames: Sequence[float], poses: Mapping[str, Array]) -> None:
    """Add keys to a stand-in.

    frames  of Blender
    poses   bone -> (frames, 4, 4) its axes and head in the world, in units of Blender
    """
    if copy.animation_data is None:
        data = copy.animation_data_create()
        data.action, data.action_slot, _ = new_action(copy.name)
    bag = copy.animation_data.action.layers[0].strips[0].channelbags[0]
    place = np.array(copy.matrix_world)
    for bone in copy.pose.bones:
        rest, above = np.array(bone.bone.matrix_local), place
        if bone.parent is not None:
            above = poses[bone.parent.name] @ np.linalg.inv(bone.parent.bone.matrix_local)
        local = [
            Matrix(each).decompose() for each in np.linalg.inv(above @ rest) @ poses[bone.name]
        ]
        values = (np.array(each) for each in zip(*local, strict=True))
        for path, each in zip(("location", "rotation_quaternion", "scale"), values, strict=True):
            add_keys(bag, bone, path, frames, each)


def remove(objects: Iterable[Any]) -> None:
    """Remove objects of stand-ins, with their armatures and actions."""
    for each in list(objects):
        rest = [each.data] if each.type == "ARMATURE" else []
        rest += [each.animation_data.action] if each.animation_data else []
        bpy.data.objects.remove(each)
        bpy.data.batch_remove(rest)
