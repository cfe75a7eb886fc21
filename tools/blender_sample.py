"""A small animal whose tail reacts to wind: the .blend, and a picture before and after the bake.

    python tools/blender_sample.py --engine .venv --out build/blender-sample

It needs Blender as a module, as `make blender-sample` installs it. The scene uses what an animator
uses in the panel: a preset of bones, IK limits, a Wind field, a cycle in rounds, and the bake.
"""

from __future__ import annotations

import argparse
import sys
import time
from itertools import pairwise
from math import cos, pi, radians, sin
from pathlib import Path
from typing import Any

import bpy

sys.path.insert(0, str(Path(__file__).parents[1]))

from blender.jobs import start_job
from blender.panel import register
from blender.process import IDLE, State

PERIOD = 24
"""Frames of the cycle."""

PICTURED = 13
"""Frame of the pictures."""

JOINTS = (0.0, 1.2, 1.5, 1.8, 2.1, 2.4, 2.7)
"""y of the bones' heads, and of the last tail, m; the first bone is the body."""

HEIGHT = 0.75
"""z of the bones, m."""

PROFILE = (
    (-0.02, 0.02),
    (0.1, 0.2),
    (0.35, 0.29),
    (0.7, 0.3),
    (1.0, 0.26),
    (1.15, 0.16),
    (1.3, 0.1),
    (1.6, 0.12),
    (1.9, 0.14),
    (2.2, 0.15),
    (2.45, 0.12),
    (2.65, 0.05),
    (2.72, 0.01),
)
"""(y, radius) along the animal, m."""

AROUND = 16
"""Vertices of a ring."""

FUR, PALE, DARK = (0.72, 0.24, 0.07), (0.85, 0.75, 0.62), (0.03, 0.02, 0.02)
GROUND, SKY = (0.22, 0.30, 0.13), (0.62, 0.76, 0.9)


def main() -> None:
    """Build the scene, run it, bake it, and render it."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--engine", required=True, help="environment of flowborne")
    parser.add_argument("--out", type=Path, required=True, help="folder")
    told = parser.parse_args()
    out = told.out.absolute()
    out.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.preferences.filepaths.save_version = 0
    register()
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 1 + PERIOD
    armature = animal()
    surroundings()
    settings(armature)
    bpy.ops.wm.save_as_mainfile(filepath=str(out / "tail.blend"))
    picture(out / "blender-tail-before.webp")
    run(told.engine)
    bpy.ops.flowborne.bake(bones="FREE")
    bpy.ops.wm.save_mainfile(compress=True)
    picture(out / "blender-tail-after.webp")


def animal() -> Any:
    """The armature with its skin, and a cycle in which the body sways and the tail wags."""
    armature = bpy.data.objects.new("animal", bpy.data.armatures.new("animal"))
    bpy.context.scene.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    above = None
    for number, (head, tail) in enumerate(pairwise(JOINTS)):
        bone = armature.data.edit_bones.new(f"tail.{number}" if number else "body")
        bone.head, bone.tail = (0.0, head, HEIGHT), (0.0, tail, HEIGHT)
        bone.parent, above = above, bone
    bpy.ops.object.mode_set(mode="OBJECT")
    skin(armature)
    limbs(armature)
    for frame in range(1, 2 + PERIOD):
        phase = 2.0 * pi * (frame - 1) / PERIOD
        for number, bone in enumerate(armature.pose.bones):
            bone.rotation_mode = "XYZ"
            bone.rotation_euler = 0.02 * sin(phase), 0.0, 0.06 * sin(phase - 0.5 * number)
            bone.keyframe_insert("rotation_euler", frame=frame)
    return armature


def skin(armature: Any) -> None:
    """A closed tube of rings, bound to the bones."""
    turns = [2.0 * pi * k / AROUND for k in range(AROUND)]
    points = [(r * cos(a), y, HEIGHT + r * sin(a)) for y, r in PROFILE for a in turns]
    starts = range(0, len(points) - AROUND, AROUND)
    faces: list[tuple[int, ...]] = [
        (ring + a, ring + AROUND + a, ring + AROUND + b, ring + b)
        for ring in starts
        for a, b in zip(range(AROUND), [*range(1, AROUND), 0], strict=True)
    ]
    last = len(points) - AROUND
    faces += [tuple(range(AROUND)), tuple(range(len(points) - 1, last - 1, -1))]
    mesh = bpy.data.meshes.new("skin")
    mesh.from_pydata(points, [], faces)
    mesh.shade_smooth()
    body = bpy.data.objects.new("skin", mesh)
    bpy.context.scene.collection.objects.link(body)
    body.parent = armature
    mesh.materials.append(paint("fur", FUR))
    groups = [body.vertex_groups.new(name=bone.name) for bone in armature.data.bones]
    for vertex, (_, y, _) in enumerate(points):
        for number, group in enumerate(groups):
            before = (y - JOINTS[number]) / 0.2 + 0.5 if number else 1.0
            after = (JOINTS[number + 1] - y) / 0.2 + 0.5 if number < len(groups) - 1 else 1.0
            share = min(1.0, before, after)
            if share > 0.0:
                group.add([vertex], share, "REPLACE")
    body.modifiers.new("Armature", "ARMATURE").object = armature
    body.modifiers.new("Smooth", "SUBSURF").levels = 1


def limbs(armature: Any) -> None:
    """Head, ears, eyes and legs, which move with the body and are not part of the run."""
    fur, pale, dark = paint("coat", FUR), paint("pale", PALE), paint("dark", DARK)
    parts = [
        ((0.0, -0.12, 1.05), (0.23, 0.26, 0.21), fur),
        ((0, -0.36, 0.99), (0.1, 0.14, 0.08), pale),
    ]
    for side in (-1.0, 1.0):
        parts += [
            ((0.13 * side, -0.06, 1.27), (0.06, 0.04, 0.14), fur),
            ((0.1 * side, -0.31, 1.12), (0.03, 0.03, 0.04), dark),
            ((0.15 * side, 0.3, 0.3), (0.07, 0.07, 0.32), fur),
            ((0.15 * side, 0.95, 0.3), (0.07, 0.07, 0.32), fur),
        ]
    parts.append(((0.0, -0.5, 1.01), (0.035, 0.03, 0.03), dark))
    for place, size, material in parts:
        bpy.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=10, location=place)
        part = bpy.context.object
        part.scale = size
        part.data.materials.append(material)
        part.data.shade_smooth()
        bpy.context.view_layer.update()
        where = part.matrix_world.copy()
        part.parent, part.parent_type, part.parent_bone = armature, "BONE", "body"
        bpy.context.view_layer.update()
        part.matrix_world = where


def surroundings() -> None:
    """Ground, sun, sky, camera, and a Wind field across the animal, with arrows along it."""
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_plane_add(size=60.0)
    bpy.context.object.name = "ground"
    bpy.context.object.data.materials.append(paint("ground", GROUND))
    bpy.ops.object.light_add(type="SUN", rotation=(radians(40.0), radians(-25.0), 0.0))
    bpy.context.object.data.energy = 2.2
    scene.world = bpy.data.worlds.new("sky")
    scene.world.use_nodes = True
    background = scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (*SKY, 1.0)
    bpy.ops.object.camera_add(location=(4.6, -2.4, 2.6))
    scene.camera = bpy.context.object
    aim = bpy.data.objects.new("aim", None)
    aim.location = 0.3, 1.2, 0.7
    scene.collection.objects.link(aim)
    look = scene.camera.constraints.new("TRACK_TO")
    look.target = aim
    bpy.ops.object.effector_add(type="WIND", location=(-1.5, 2.0, HEIGHT))
    bpy.context.object.rotation_euler = 0.0, radians(90.0), 0.0
    bpy.context.object.field.strength = 12.0
    white = paint("arrow", (0.9, 0.9, 0.9))
    for y in (1.7, 2.4, 3.1):
        for shape, x, size in (
            (bpy.ops.mesh.primitive_cylinder_add, -1.5, (0.02, 0.02, 0.3)),
            (bpy.ops.mesh.primitive_cone_add, -1.1, (0.06, 0.06, 0.1)),
        ):
            shape(location=(x, y, HEIGHT), rotation=(0.0, radians(90.0), 0.0))
            bpy.context.object.scale = size
            bpy.context.object.data.materials.append(white)


def settings(armature: Any) -> None:
    """What an animator sets in the panel."""
    bpy.context.view_layer.objects.active = armature
    bpy.ops.flowborne.preset(kind="TAIL")
    for bone in armature.pose.bones:
        if bone.select:
            for axis in "xyz":
                setattr(bone, f"use_ik_limit_{axis}", True)
                setattr(bone, f"ik_min_{axis}", radians(-30.0))
                setattr(bone, f"ik_max_{axis}", radians(30.0))
    chosen = armature.flowborne
    chosen.wind = next(
        each for each in bpy.data.objects if each.field is not None and each.field.type == "WIND"
    )
    chosen.density, chosen.rounds, chosen.strength = 60.0, 4, radians(180.0)
    chosen.follow = 0.05


def run(engine: str) -> None:
    """Run to the end, and say how long it took."""
    began = time.monotonic()
    job = start_job(bpy.context, engine)
    while job.step() not in IDLE:
        time.sleep(0.1)
    if job.state is not State.DONE:
        raise SystemExit(job.message)
    print(f"{job.reaction.frames} frames in {time.monotonic() - began:.0f} s")


def paint(name: str, colour: tuple[float, float, float]) -> Any:
    """A matt material."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    shader = material.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*colour, 1.0)
    shader.inputs["Roughness"].default_value = 0.7
    return material


def picture(path: Path) -> None:
    """One frame by Cycles, on processors alone."""
    scene = bpy.context.scene
    scene.frame_set(PICTURED)
    scene.render.engine = "CYCLES"
    scene.view_settings.view_transform = "Standard"
    scene.cycles.samples, scene.cycles.use_denoising = 32, True
    scene.render.resolution_x, scene.render.resolution_y = 800, 450
    scene.render.image_settings.file_format, scene.render.image_settings.quality = "WEBP", 80
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)


if __name__ == "__main__":
    main()
