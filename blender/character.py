# SPDX-License-Identifier: GPL-3.0-or-later
"""A character of a Blender scene: its armature, its meshes, and the settings of its run."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from statistics import mode
from typing import Any

import bpy
import numpy as np
from mathutils import Vector as Corner

from .motion import Array
from .reaction import Reaction, ReactionError, Vector
from .stand_in import parents_of, play, stand_in

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


def ink_of(settings: Any, unit: float) -> tuple[Vector, Vector] | tuple[()]:
    """Corners in m of the box around the object that colours the flow; empty without one."""
    source = settings.ink if settings.simulated else None
    if source is None:
        return ()
    corners = np.array([source.matrix_world @ Corner(corner) for corner in source.bound_box])
    if not np.ptp(corners, axis=0).all():
        raise ReactionError(f"object '{source.name}' has no volume: choose a mesh for Ink")
    x, y, z = (unit * corners.min(axis=0)).tolist()
    u, v, w = (unit * corners.max(axis=0)).tolist()
    return (x, y, z), (u, v, w)


def reaction_of(context: Any, armature: Any, settings: Any) -> Reaction:
    """The settings of a run, from the panel, the selected pose bones and the scene.

    raises  ReactionError for settings that cannot be used
    """
    check_armature(armature)
    scene, unit = context.scene, context.scene.unit_settings.scale_length
    free = selected_bones(armature)
    _check_carried(armature, free)
    cones = {bone.name: cone for bone in free if (cone := cone_of(control_of(bone))) is not None}
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
        ink=ink_of(settings, unit),
        young=0.0 if settings.flesh == "NONE" else 1e3 * settings.stiffness,
        follows=settings.flesh == "FOLLOW",
    )


def control_of(bone: Any) -> Any:
    """The pose bone whose place a pose bone copies: a control of its rig, or the bone itself."""
    return _chain(bone)[-1]


def end_of(bone: Any) -> str:
    """Name of the pose bone to which a pose bone, or one whose place it copies, is stretched."""
    return next(
        (
            limit.subtarget
            for each in _chain(bone)
            for limit in each.constraints
            if limit.type == "STRETCH_TO" and _is_full(limit)
        ),
        "",
    )


def _chain(bone: Any) -> list[Any]:
    """A pose bone, the one whose place it copies, the one whose place that copies, and so on."""
    found = []
    while bone is not None and bone not in found:
        found.append(bone)
        copies = (
            limit.subtarget
            for limit in bone.constraints
            if limit.type == "COPY_TRANSFORMS"
            and _is_full(limit)
            and {limit.owner_space, limit.target_space} <= {"WORLD", "POSE"}
        )
        bone = bone.id_data.pose.bones.get(next(copies, ""))
    return found


def _is_full(constraint: Any) -> bool:
    """Whether a constraint to the same armature acts in full."""
    full = constraint.influence == 1.0 and not constraint.mute
    return full and constraint.target == constraint.id_data


def is_selected(bone: Any) -> bool:
    """Whether a pose bone is selected and shown: hidden bones of a rig may be selected unseen."""
    collections = bone.bone.collections
    shown = not collections or any(each.is_visible_effectively for each in collections)
    return bool(shown and bone.select and not bone.hide)


def selected_bones(armature: Any) -> list[Any]:
    """Deforming pose bones that are selected, or whose control is.

    raises  ReactionError for other bones in the selection
    """
    controls = {bone: control_of(bone) for bone in armature.pose.bones if bone.bone.use_deform}
    selected = [bone for bone in armature.pose.bones if is_selected(bone)]
    for bone in selected:
        if bone not in controls and bone not in controls.values():
            raise ReactionError(
                f"bone '{bone.name}' deforms nothing, and no deforming bone copies its place: "
                "select others (in Rigify those of the collection 'Tweak' or 'DEF')"
            )
    return [bone for bone, control in controls.items() if {bone, control} & {*selected}]


def in_frames(context: Any, frames: Iterable[int]) -> Iterator[int]:
    """Set the scene to each of these frames, and at last to the present one again."""
    scene = context.scene
    current = scene.frame_current, scene.frame_subframe
    try:
        for frame in frames:
            scene.frame_set(frame)
            yield frame
    finally:
        scene.frame_set(current[0], subframe=current[1])


def _check_carried(armature: Any, bones: Iterable[Any]) -> None:
    """Raise ReactionError for bones that hang on a control bone apart from the body."""
    bodies = parents_of(armature.data.bones)
    roots = {name: name for name in bodies}
    while any(bodies[root] for root in roots.values()):
        roots = {name: bodies[root] or root for name, root in roots.items()}
    main = mode(roots.values()) if roots else ""
    for bone in bones:
        root = roots[bone.name]
        if root != main and not armature.data.bones[root].use_deform:
            raise ReactionError(
                f"bone '{bone.name}' hangs on control '{root}' instead of a deforming bone, as "
                "tails of Rigify's type spines.basic_tail do: use limbs.simple_tentacle for this "
                "chain, and generate the rig again"
            )


def poses_of(
    context: Any, armature: Any, frames: Iterable[int], bones: Iterable[str]
) -> tuple[Array, dict[str, Array]]:
    """(frames, 4, 4) axes of an armature to the world's, and of bones to the armature's."""
    places: list[Array] = []
    found: dict[str, list[Array]] = {name: [] for name in bones}
    for _ in in_frames(context, frames):
        places.append(np.array(armature.matrix_world))
        for name, poses in found.items():
            poses.append(np.array(armature.pose.bones[name].matrix))
    return np.array(places), {name: np.array(poses) for name, poses in found.items()}


def export_character(context: Any, armature: Any, path: Path, first: int, last: int) -> None:
    """Write armature, meshes and animation of frames of Blender as a .glb file.

    Modifiers other than the armature's are applied. Selection, mode and frame stay as they are.
    raises  ReactionError when the armature is hidden, or no mesh is visible
    """
    if not armature.visible_get():
        raise ReactionError(f"armature '{armature.name}' is hidden: show it for the export")
    meshes = meshes_of(context, armature)
    path.parent.mkdir(parents=True, exist_ok=True)
    frames, bones = range(first, last + 1), parents_of(armature.data.bones)
    with _without_bakes(armature):
        places, poses = poses_of(context, armature, frames, bones)
    render = context.scene.render
    with stand_in(context, armature, meshes, armature.name) as (copy, scene):
        play(copy, range(len(frames)), {name: places @ pose for name, pose in poses.items()})
        scene.frame_start, scene.frame_end = 0, last - first
        # Times of the file are in seconds, but the exporter multiplies by the base of the rate.
        scene.render.fps, scene.render.fps_base = render.fps, 1.0 / render.fps_base
        with context.temp_override(scene=scene, view_layer=scene.view_layers[0]):
            bpy.ops.export_scene.gltf(
                filepath=str(path),
                export_format="GLB",
                use_active_scene=True,
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
def _without_bakes(armature: Any) -> Iterator[None]:
    """Context in which the earlier bakes of an armature are muted."""
    tracks = armature.animation_data.nla_tracks if armature.animation_data else ()
    bakes = [track for track in tracks if track.name.startswith(TRACK) and not track.mute]
    try:
        for track in bakes:
            track.mute = True
        yield
    finally:
        for track in bakes:
            track.mute = False
