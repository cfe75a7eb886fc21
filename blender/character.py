# SPDX-License-Identifier: GPL-3.0-or-later
"""A character of a Blender scene: its armature, its meshes, and the settings of its run."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from .reaction import Reaction, ReactionError, Vector

TRACK = "flowborne"
"""Start of the names of our NLA tracks."""

UNIFORM = 1e-4
"""Largest difference of an armature's scales along its axes, relative."""

MEDIA = {"AIR": 1.2, "WATER": 1000.0}
"""kg/m^3"""


def armature_of(context: Any) -> Any:
    """The active armature, or that of the active mesh. Raises ReactionError without one."""
    active = context.object
    found = active if active is None or active.type == "ARMATURE" else active.find_armature()
    if found is None:
        raise ReactionError("no armature is active: select the armature of the character")
    return found


def check_armature(armature: Any) -> None:
    """Raise ReactionError for an armature that is linked, mirrored, or scaled unevenly."""
    if armature.library is not None:
        raise ReactionError(
            f"armature '{armature.name}' is linked from {armature.library.filepath} and cannot be "
            "animated here: make a library override (Object, Library Override, Make)"
        )
    inner = armature.matrix_world.to_3x3()
    if inner.determinant() <= 0.0:
        raise ReactionError(
            f"armature '{armature.name}' has a negative scale, or none: apply it (Object, Apply, "
            "Scale)"
        )
    scales = np.array(inner.to_scale())
    if np.ptp(scales) > UNIFORM * scales.max():
        raise ReactionError(
            f"armature '{armature.name}' has the scale {', '.join(f'{s:.3g}' for s in scales)}: "
            "apply it (Object, Apply, Scale), or make it equal along all axes"
        )


def meshes_of(context: Any, armature: Any) -> list[Any]:
    """Visible meshes that the armature deforms; the selected ones of them, if there are any.

    raises  ReactionError without one
    """
    bound = [
        thing
        for thing in context.view_layer.objects
        if thing.type == "MESH" and thing.visible_get() and thing.find_armature() == armature
    ]
    if not bound:
        raise ReactionError(
            f"no visible mesh is bound to armature '{armature.name}': parent one to it (Object, "
            "Parent, With Automatic Weights)"
        )
    return [mesh for mesh in bound if mesh.select_get()] or bound


def cone_of(bone: Any) -> float | None:
    """Angle in degrees that a pose bone may turn from rest in any direction; None without a limit.

    It is the smallest limit of the bone's Limit Rotation constraints and IK limits, so that every
    pose of the run is within all of them.
    raises  ReactionError for a constraint in another space, or limits that leave no cone
    """
    found = []
    for axis in "xyz":
        if getattr(bone, f"lock_ik_{axis}"):
            found.append(0.0)
        elif getattr(bone, f"use_ik_limit_{axis}"):
            found += [-getattr(bone, f"ik_min_{axis}"), getattr(bone, f"ik_max_{axis}")]
    for limit in bone.constraints:
        if limit.type != "LIMIT_ROTATION" or limit.mute or limit.influence == 0.0:
            continue
        if limit.owner_space != "LOCAL":
            raise ReactionError(
                f"bone '{bone.name}': the owner space of '{limit.name}' is not Local Space. Set it"
            )
        for axis in "xyz":
            if getattr(limit, f"use_limit_{axis}"):
                found += [-getattr(limit, f"min_{axis}"), getattr(limit, f"max_{axis}")]
    if not found:
        return None
    if min(found) <= 0.0:
        raise ReactionError(
            f"bone '{bone.name}': its Limit Rotation or IK limit locks an axis, or excludes "
            "the rest pose, but a free bone turns about all axes. Widen the limits, or clear them"
        )
    return math.degrees(min(found))


def flow_of(settings: Any) -> Vector:
    """Velocity of the medium, m/s: along z of the Wind empty, or the vector of the settings.

    raises  ReactionError for a force field that is no uniform wind
    """
    source = settings.wind
    if source is None:
        x, y, z = settings.flow
        return x, y, z
    if source.field is None or source.field.type != "WIND":
        kind = "none" if source.field is None else source.field.type.replace("_", " ").capitalize()
        raise ReactionError(
            f"the force field of '{source.name}' is {kind}, but the flow of a run is uniform far "
            "from the character: choose an object with a Wind field, or none, and set the vector"
        )
    x, y, z = source.matrix_world.to_3x3().col[2].normalized() * source.field.strength
    return x, y, z


def reaction_of(context: Any, armature: Any, settings: Any) -> Reaction:
    """The settings of a run, from the panel, the selected pose bones and the scene.

    raises  ReactionError for settings that cannot be used
    """
    check_armature(armature)
    scene, unit = context.scene, context.scene.unit_settings.scale_length
    free = [bone for bone in armature.pose.bones if bone.select]
    cones = {bone.name: cone for bone in free if (cone := cone_of(bone)) is not None}
    length = scene.frame_end - scene.frame_start
    rounds = settings.rounds
    gravity = [unit * g for g in scene.gravity] if scene.use_gravity else (0.0, 0.0, 0.0)
    return Reaction(
        bones=tuple(bone.name for bone in free),
        cones=cones,
        first=scene.frame_start,
        frames=rounds * length if rounds > 1 else settings.preroll + length,
        lead=(rounds - 1) * length if rounds > 1 else settings.preroll,
        loop=rounds > 1,
        rate=scene.render.fps / scene.render.fps_base,
        unit=unit,
        density=settings.density,
        medium=MEDIA.get(settings.medium, settings.own_density),
        flow=flow_of(settings),
        simulated=settings.simulated,
        resolution=settings.resolution,
        gravity=(gravity[0], gravity[1], gravity[2]),
        floats=settings.floats,
        objective=settings.objective,
        follow=settings.follow,
        strength=math.degrees(settings.strength),
    )


def export_character(context: Any, armature: Any, path: Path, earlier: int = 0) -> None:
    """Write armature, meshes and animation of the scene's frame range as a .glb file.

    The animation starts `earlier` frames before the range.

    Modifiers other than the armature's are applied. Selection, mode and frame stay as they are.
    raises  ReactionError when the armature is hidden, or no mesh is visible
    """
    if not armature.visible_get():
        raise ReactionError(f"armature '{armature.name}' is hidden: show it for the export")
    meshes = meshes_of(context, armature)
    path.parent.mkdir(parents=True, exist_ok=True)
    with _ready(context, armature, meshes, earlier):
        bpy.ops.export_scene.gltf(
            filepath=str(path),
            export_format="GLB",
            use_selection=True,
            export_apply=True,
            export_animation_mode="SCENE",
            export_anim_scene_split_object=False,
            export_frame_range=True,
            export_force_sampling=True,
            export_optimize_animation_size=False,
            export_rest_position_armature=True,
            export_all_influences=True,
            export_morph=False,
            export_materials="NONE",
            export_normals=False,
            export_texcoords=False,
            export_cameras=False,
            export_lights=False,
        )


@contextmanager
def _ready(context: Any, armature: Any, meshes: list[Any], earlier: int) -> Iterator[None]:
    """Context in which the character alone is selected, its earlier bakes are muted, and the frame
    range starts earlier.

    Times of a glTF file are in seconds. Blender's exporter multiplies the rate by `fps_base`, by
    which it has to be divided, so that the context holds its inverse.
    """
    scene, objects = context.scene, context.view_layer.objects
    active, mode, frame = objects.active, armature.mode, scene.frame_current
    selected, base = [thing for thing in objects if thing.select_get()], scene.render.fps_base
    tracks = armature.animation_data.nla_tracks if armature.animation_data else ()
    bakes = [track for track in tracks if track.name.startswith(TRACK) and not track.mute]
    objects.active = armature
    bpy.ops.object.mode_set(mode="OBJECT")
    try:
        for thing in objects:
            thing.select_set(thing == armature or thing in meshes)
        for track in bakes:
            track.mute = True
        scene.render.fps_base = 1.0 / base
        scene.frame_start -= earlier
        yield
    finally:
        scene.render.fps_base = base
        scene.frame_start += earlier
        for track in bakes:
            track.mute = False
        for thing in objects:
            thing.select_set(thing in selected)
        bpy.ops.object.mode_set(mode=mode)
        objects.active = active
        scene.frame_set(frame)
