"""What the scenarios share: a rigged box, a recorded run, and comparisons.

Scenarios run in Blender's Python, one process each, with the project's root on its path;
`sys.argv[1]` is an empty folder.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from blender.reaction import Reaction
from mathutils import Euler, Matrix, Quaternion

import blender

FOLDER = Path(sys.argv[1])

BONES = ("trunk", "tail", "tip")
JOINTS = (0.0, 0.8, 1.4, 2.0)
"""y of the bones' heads and of the last tail, m; all are at z = 1."""

CLOSE = 1e-5
"""Accepted difference of rotations, and of places in sizes of the character."""


def new_scene(first: int = 1, last: int = 12) -> Any:
    """An empty scene with the extension, saved in FOLDER."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if not hasattr(bpy.types.Object, "flowborne"):
        blender.register()
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = first, last
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "shot.blend"))
    return scene


def install_extension() -> str:
    """Build the extension, install it as a user does, and return the name of its module."""
    (builder,) = Path(bpy.utils.system_resource("SCRIPTS")).rglob("blender_ext.py")
    source, archive = Path(blender.__file__).parent, FOLDER / "flowborne.zip"
    for command in (
        ("build", "--source-dir", source, "--output-filepath", archive),
        ("validate", archive),
    ):
        subprocess.run([sys.executable, builder, *command], check=True)
    assert Path(bpy.utils.user_resource("EXTENSIONS")).is_relative_to(
        os.environ["BLENDER_USER_RESOURCES"]
    )
    bpy.ops.extensions.package_install_files(
        filepath=str(archive), repo="user_default", enable_on_install=True
    )
    return "bl_ext.user_default.flowborne"


def character(
    name: str = "rig", modes: Sequence[str] = ("QUATERNION",) * 3, first: int | None = None
) -> Any:
    """An armature of three bones with a box bound to it, and an action that moves all bones, from
    the first frame of the scene or another one."""
    scene = bpy.context.scene
    armature = bpy.data.objects.new(name, bpy.data.armatures.new(name))
    scene.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    parent = None
    for number, bone in enumerate(BONES):
        edited = armature.data.edit_bones.new(bone)
        edited.head = 0.0, JOINTS[number], 1.0
        edited.tail = 0.0, JOINTS[number + 1], 1.0
        edited.roll = 0.3 * number
        edited.parent, parent = parent, edited
    bpy.ops.object.mode_set(mode="OBJECT")
    bind(armature)
    first = scene.frame_start if first is None else first
    for bone, mode in zip(armature.pose.bones, modes, strict=True):
        bone.rotation_mode = mode
    for frame in range(first, scene.frame_end + 1):
        for number, bone in enumerate(armature.pose.bones):
            turn = Euler((0.2 * math.sin(0.5 * frame + number), 0.1 * number, 0.05 * frame))
            set_rotation(bone, turn.to_quaternion())
            bone.keyframe_insert(path_of(bone), frame=frame)
        armature.pose.bones[0].location = 0.02 * frame, 0.0, 0.1
        armature.pose.bones[0].keyframe_insert("location", frame=frame)
    return armature


def bind(armature: Any, bones: Sequence[str] = BONES) -> None:
    """Bind a closed box around three bones, which are at JOINTS, to an armature."""
    rings = np.linspace(JOINTS[0], JOINTS[-1], 21)
    corners = [(-0.15, 0.9), (0.15, 0.9), (0.15, 1.1), (-0.15, 1.1)]
    points = [(x, y, z) for y in rings for x, z in corners]
    faces = [(0, 1, 2, 3), (83, 82, 81, 80)]
    for ring in range(0, 80, 4):
        for a in range(4):
            b = (a + 1) % 4
            faces.append((ring + a, ring + 4 + a, ring + 4 + b, ring + b))
    mesh = bpy.data.meshes.new(armature.name)
    mesh.from_pydata(points, [], faces)
    body = bpy.data.objects.new(f"{armature.name} body", mesh)
    bpy.context.scene.collection.objects.link(body)
    body.parent = armature
    for number, bone in enumerate(bones):
        group = body.vertex_groups.new(name=bone)
        low, high = JOINTS[number] if number else -1.0, JOINTS[number + 1] if number < 2 else 9.0
        for vertex, (_, y, _) in enumerate(points):
            share = min(1.0, 0.5 + 5.0 * min(y - low, high - y))
            if share > 0.0:
                group.add([vertex], share, "REPLACE")
    body.modifiers.new("Armature", "ARMATURE").object = armature


def path_of(bone: Any) -> str:
    """Property of a bone's rotation mode."""
    paths = {"QUATERNION": "rotation_quaternion", "AXIS_ANGLE": "rotation_axis_angle"}
    return paths.get(bone.rotation_mode, "rotation_euler")


def set_rotation(bone: Any, turn: Quaternion) -> None:
    """Give a bone a rotation in its own mode."""
    if bone.rotation_mode == "QUATERNION":
        bone.rotation_quaternion = turn
    elif bone.rotation_mode == "AXIS_ANGLE":
        axis, angle = turn.to_axis_angle()
        bone.rotation_axis_angle = angle, *axis
    else:
        bone.rotation_euler = turn.to_euler(bone.rotation_mode)


def select(armature: Any, *bones: str) -> None:
    """Make an armature active, and select these pose bones of it."""
    for thing in bpy.context.view_layer.objects:
        thing.select_set(thing == armature)
    bpy.context.view_layer.objects.active = armature
    for bone in armature.pose.bones:
        bone.select = bone.name in bones


def world_of(armature: Any) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) and (n, 3, 3) heads and axes of all bones in the world, as evaluated."""
    matrices = np.array([armature.matrix_world @ bone.matrix for bone in armature.pose.bones])
    inner = matrices[:, :3, :3]
    return matrices[:, :3, 3], inner / np.linalg.norm(inner, axis=1, keepdims=True)


def animation(armature: Any) -> tuple[np.ndarray, np.ndarray]:
    """(frames, n, 3) and (frames, n, 3, 3) of the scene's range."""
    scene, found = bpy.context.scene, []
    for frame in range(scene.frame_start, scene.frame_end + 1):
        scene.frame_set(frame)
        found.append(world_of(armature))
    position, rotation = zip(*found, strict=True)
    return np.array(position), np.array(rotation)


def swing(frames: int, most: float = 1.0) -> list[Quaternion]:
    """Rotations about an axis that turns, up to `most` rad; the first is none."""
    return [
        Quaternion((math.sin(0.3 * k), 0.4, math.cos(0.3 * k)), most * math.sin(0.7 * k))
        for k in range(frames)
    ]


def recorded(
    armature: Any,
    free: Sequence[str] = ("tail", "tip"),
    *,
    unit: float = 1.0,
    turns: Sequence[Quaternion] | None = None,
    called: str = "job",
) -> Path:
    """A job with a complete run, as flowborne writes it; returns the folder of the run.

    Free bones turn by `turns` from their rest pose; others are as the armature is animated.
    """
    scene = bpy.context.scene
    frames = scene.frame_end - scene.frame_start + 1
    position, rotation = animation(armature)
    for name in (n for n in BONES if n in free):
        number, bone = BONES.index(name), armature.data.bones[name]
        above = armature.data.bones[number - 1]
        offset = np.array(above.matrix_local.inverted() @ bone.matrix_local)
        scale = armature.matrix_world.to_scale()[0]
        for k, turn in enumerate(turns or swing(frames)):
            parent = rotation[k, number - 1]
            rotation[k, number] = parent @ offset[:3, :3] @ np.array(turn.to_matrix())
            position[k, number] = position[k, number - 1] + scale * parent @ offset[:3, 3]
    job = FOLDER / called
    (job / "run" / "states").mkdir(parents=True)
    model = {"bodies": ["world", *BONES], "joints": list(BONES)}
    (job / "run" / "model.json").write_text(json.dumps(model))
    for k in range(frames):
        body_position = np.concatenate([np.zeros((1, 3)), unit * position[k]])
        body_rotation = np.concatenate([np.eye(3)[None], rotation[k]])
        np.savez(
            job / "run" / "states" / f"{k:06}.npz",
            body_position=body_position.astype(np.float32),
            body_rotation=body_rotation.astype(np.float32),
            fluid_centre=body_position.astype(np.float32),
            fluid_force=force_on(k).astype(np.float32),
        )
    rate = scene.render.fps / scene.render.fps_base
    Reaction(tuple(free), {}, scene.frame_start, frames - 1, rate, unit).save(job / "job.json")
    armature.flowborne.folder = str(job)
    return job / "run"


def add_skin(armature: Any, run: Path, unit: float = 1.0, wobble: float = 0.1) -> np.ndarray:
    """Flesh around tail and tip in a recorded run: its skin is the mesh behind the trunk, which
    each frame moves with a bone and wobbles by up to `wobble` m. Returns the numbers of the mesh's
    vertices that are those of the skin."""
    body = bpy.data.objects[f"{armature.name} body"]
    points = np.array([vertex.co for vertex in body.data.vertices])
    own = np.flatnonzero(points[:, 1] > 0.95)
    faces = [(0, 1, 2, 3), tuple(range(len(own) - 1, len(own) - 5, -1))]
    faces += [
        (at + a, at + 4 + a, at + 4 + (a + 1) % 4, at + (a + 1) % 4)
        for at in range(0, len(own) - 4, 4)
        for a in range(4)
    ]
    triangles = [(f[0], f[n], f[n + 1]) for f in faces for n in (1, 2)]
    scale = unit * armature.matrix_world.to_scale()[0]
    rest = scale * points[own]
    heads = scale * np.array([bone.head_local for bone in armature.data.bones])
    axes = np.array([bone.matrix_local.to_3x3() for bone in armature.data.bones])
    carrier = np.where(points[own, 1] < JOINTS[2], 1, 2)
    local = np.einsum("kji,kj->ki", axes[carrier], rest - heads[carrier])
    elsewhere = np.array([7.0, 0.0, 0.0])  # the model is at rest there
    model = json.loads((run / "model.json").read_text())
    model["flesh"] = {
        "triangles": triangles,
        "rest": (rest + elsewhere).tolist(),
        "bodies": [0, 1, 2, 3],
        "body_position": [[0.0, 0.0, 0.0], *(heads + elsewhere).tolist()],
        "body_rotation": [np.eye(3).tolist(), *axes.tolist()],
    }
    (run / "model.json").write_text(json.dumps(model))
    for k, path in enumerate(sorted((run / "states").iterdir())):
        state = dict(np.load(path))
        shaken = local + wobble * np.sin(0.7 * k + 20.0 * local / scale) * [1.0, 0.3, 0.7]
        turned = np.einsum("kij,kj->ki", state["body_rotation"][carrier + 1], shaken)
        state["flesh_vertices"] = state["body_position"][carrier + 1] + turned
        np.savez(path, **state)
    job = run.parent / "job.json"
    job.write_text(json.dumps(json.loads(job.read_text()) | {"young": 5e4}))
    return own


def shown(body: Any, frame: float) -> np.ndarray:
    """(n, 3) vertices of a mesh in the world, as evaluated at a frame."""
    bpy.context.scene.frame_set(math.floor(frame), subframe=frame % 1.0)
    drawn = body.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return np.array([drawn.matrix_world @ vertex.co for vertex in drawn.data.vertices])


def skin_of(run: Path, frame: int, unit: float = 1.0) -> np.ndarray:
    """(k, 3) the skin of flesh in a frame of a run, in units of Blender."""
    return np.load(run / "states" / f"{frame:06}.npz")["flesh_vertices"] / unit


def force_on(frame: int) -> np.ndarray:
    """(4, 3) N on the world and the bodies of a recorded run; none on the world and the trunk."""
    return np.outer([0.0, 0.0, 1.0, 2.0], [1.0, 0.1 * frame, -0.5])


def bake(armature: Any, bones: str = "FREE") -> Any:
    """Press Bake on an armature, and return the strip."""
    bpy.context.view_layer.objects.active = armature
    assert bpy.ops.flowborne.bake(bones=bones) == {"FINISHED"}
    return armature.animation_data.nla_tracks[-1].strips[0]


def check_equal(armature: Any, run: Path, bones: Sequence[str], unit: float = 1.0) -> None:
    """The bones are in every frame as in the run."""
    position, rotation = animation(armature)
    for k, path in enumerate(sorted((run / "states").iterdir())):
        state = np.load(path)
        for name in bones:
            n = BONES.index(name)
            turned = np.abs(state["body_rotation"][n + 1] - rotation[k, n]).max()
            moved = np.abs(state["body_position"][n + 1] / unit - position[k, n]).max()
            assert turned < CLOSE, f"frame {k}, {name}: rotated by {turned:.2g}"
            size = armature.matrix_world.to_scale()[0] * JOINTS[-1]
            assert moved < CLOSE * size, f"frame {k}, {name}: moved by {moved:.2g}"


def refusal(armature: Any, operator: str = "bake", **options: str) -> str:
    """The message with which an operator refuses."""
    bpy.context.view_layer.objects.active = armature
    return message(RuntimeError, partial(getattr(bpy.ops.flowborne, operator), **options))


def message(error: type[Exception], call: Callable[..., Any], *given: Any) -> str:
    """The message of an error that a call raises."""
    try:
        call(*given)
    except error as raised:
        return str(raised)
    raise AssertionError(f"{call} raised no {error.__name__}")


def curves(action: Any) -> dict[tuple[str, int], list[tuple[float, float]]]:
    """Keys of an action with one slot, by path and index."""
    (layer,) = action.layers
    (bag,) = layer.strips[0].channelbags
    return {
        (curve.data_path, curve.array_index): [tuple(p.co) for p in curve.keyframe_points]
        for curve in bag.fcurves
    }


def place(armature: Any) -> None:
    """Move, turn and scale an armature."""
    armature.matrix_world = Matrix.LocRotScale(
        (3.0, -2.0, 0.5), Euler((0.3, -0.4, 2.0)), (2.5, 2.5, 2.5)
    )
    bpy.context.view_layer.update()
