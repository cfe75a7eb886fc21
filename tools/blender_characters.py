"""Characters of the samples for Blender: a fox, a swimmer, a bird and a bear, each with a cycle.

Skins of the bodies in a run are closed tubes along bones. Heads, legs and arms are parts that move
with a bone and are in no run. All characters look along -y; lengths are in m.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from math import cos, pi, sin
from typing import Any

import bmesh
import bpy
import numpy as np

PERIOD = 24
"""Frames of a cycle."""

AROUND = 16
"""Vertices of a ring."""

HOP = 0.45
"""Height of a hop, m."""

BLEND = 0.2
"""Length of a tube over which the weight passes from one bone to the next, in mean bone lengths."""

Point = tuple[float, float, float]
Colour = tuple[float, float, float]
Part = tuple[Point, Point, Colour]
"""Centre, half axes and colour of an ellipsoid."""

FUR, PALE, DARK = (0.72, 0.24, 0.07), (0.85, 0.75, 0.62), (0.03, 0.02, 0.02)
SKIN, SUIT, HAIR = (0.75, 0.45, 0.32), (0.05, 0.1, 0.35), (0.12, 0.05, 0.02)
BROWN = (0.33, 0.16, 0.06)
PLUMAGE, WING, BEAK = (0.9, 0.9, 0.92), (0.42, 0.45, 0.5), (0.9, 0.5, 0.05)


def fox() -> Any:
    """A fox on its legs that sways and wags; its tail points back."""
    height, joints = 0.75, (0.0, 1.2, 1.5, 1.8, 2.1, 2.4, 2.7)
    names = ["body", *(f"tail.{k}" for k in range(1, 6))]
    rig = armature("fox", {n: pair for n, pair in chain(names, [(0.0, y, height) for y in joints])})
    profile = [(-0.02, 0.02), (0.1, 0.2), (0.35, 0.29), (0.7, 0.3), (1.0, 0.26), (1.15, 0.16)]
    profile += [(1.3, 0.1), (1.6, 0.12), (1.9, 0.14), (2.2, 0.15), (2.45, 0.12), (2.65, 0.05)]
    rings = [((0.0, y, height), (r, 0.0, 0.0), (0.0, 0.0, r)) for y, r in [*profile, (2.72, 0.01)]]
    tube(rig, names, rings, FUR)
    sides: list[Part] = []
    for side in (-1.0, 1.0):
        sides += [
            ((0.13 * side, -0.06, 1.27), (0.06, 0.04, 0.14), FUR),
            ((0.1 * side, -0.31, 1.12), (0.03, 0.03, 0.04), DARK),
            ((0.15 * side, 0.3, 0.3), (0.07, 0.07, 0.32), FUR),
            ((0.15 * side, 0.95, 0.3), (0.07, 0.07, 0.32), FUR),
        ]
    head: list[Part] = [
        ((0.0, -0.12, 1.05), (0.23, 0.26, 0.21), FUR),
        ((0.0, -0.36, 0.99), (0.1, 0.14, 0.08), PALE),
        ((0.0, -0.5, 1.01), (0.035, 0.03, 0.03), DARK),
    ]
    carry(rig, "body", head + sides)
    cycle(rig, {name: (0.02, 0.06, -0.5 * k) for k, name in enumerate(names)})
    return rig


def swimmer() -> Any:
    """A swimmer who nods below the surface; a pony tail stands up from the head."""
    tail = [(0.0, 0.12 + 0.05 * k, 0.12 + 0.17 * k) for k in range(4)]
    names = ["hair.1", "hair.2", "hair.3"]
    bones = {"body": ((0.0, 0.0, 0.0), (0.0, 0.85, 0.0))} | dict(chain(names, tail))
    rig = armature("swimmer", bones, {"hair.1": "body"})
    widths = [(-0.16, 0.02, 0.02), (-0.1, 0.1, 0.11), (0.0, 0.13, 0.15), (0.1, 0.11, 0.13)]
    widths += [(0.17, 0.07, 0.08), (0.25, 0.13, 0.09), (0.34, 0.22, 0.11), (0.5, 0.19, 0.12)]
    widths += [(0.65, 0.15, 0.1), (0.8, 0.18, 0.11), (0.92, 0.1, 0.08), (0.95, 0.02, 0.02)]
    tube(rig, ["body"], [((0.0, y, 0.0), (a, 0.0, 0.0), (0.0, 0.0, b)) for y, a, b in widths], SKIN)
    along = np.linspace(-0.05, 1.0, 9)
    middle = [tuple((1.0 - s) * np.array(tail[0]) + s * np.array(tail[-1])) for s in along]
    radii = 0.075 * np.sqrt(np.maximum(1.0 - (1.8 * along - 0.8) ** 2, 0.04))
    rings = [(c, (r, 0.0, 0.0), (0.0, -r, 0.28 * r)) for c, r in zip(middle, radii, strict=True)]
    tube(rig, names, rings, HAIR)
    parts: list[Part] = [((0.0, 0.82, 0.0), (0.19, 0.16, 0.125), SUIT)]
    for side in (-1.0, 1.0):
        parts += [
            ((0.1 * side, 1.15, 0.0), (0.08, 0.35, 0.085), SKIN),
            ((0.1 * side, 1.65, -0.02), (0.055, 0.32, 0.06), SKIN),
            ((0.1 * side, 1.98, -0.02), (0.05, 0.12, 0.03), SKIN),
            ((0.22 * side, 0.12, -0.02), (0.05, 0.28, 0.05), SKIN),
            ((0.17 * side, -0.28, -0.03), (0.04, 0.26, 0.04), SKIN),
            ((0.05 * side, -0.17, 0.03), (0.03, 0.02, 0.025), DARK),
        ]
    carry(rig, "body", parts)
    cycle(rig, {"body": (0.12, 0.0, 0.0)})
    return rig


def bird() -> Any:
    """A bird that flaps; the outer wings are stiff."""
    height = 1.5
    bones = {"body": ((0.0, 0.0, height), (0.0, 0.5, height))}
    sides, above = {"L": 1.0, "R": -1.0}, {}
    for side, sign in sides.items():
        joints = [(sign * x, 0.17, height + 0.03) for x in (0.05, 0.3, 0.52, 0.74)]
        names = [f"upperarm.{side}", f"wing.1.{side}", f"wing.2.{side}"]
        bones |= dict(chain(names, joints))
        above[names[0]] = "body"
    rig = armature("bird", bones, above)
    profile = [(-0.07, 0.01), (-0.04, 0.045), (0.03, 0.06), (0.1, 0.07), (0.22, 0.09), (0.36, 0.07)]
    profile += [(0.48, 0.035), (0.5, 0.01)]
    rings = [((0.0, y, height), (r, 0.0, 0.0), (0.0, 0.0, r)) for y, r in profile]
    tube(rig, ["body"], rings, PLUMAGE)
    for side, sign in sides.items():
        chords = [(0.0, 0.02), (0.04, 0.11), (0.2, 0.13), (0.4, 0.12), (0.6, 0.09), (0.72, 0.05)]
        wing = [
            ((sign * (0.04 + x), 0.17 + 0.2 * x * x, height + 0.03), (0.0, -c, 0.0), (0.0, 0.0, t))
            for x, c in [*chords, (0.76, 0.01)]
            for t in [0.1 * c + 0.003]
        ]
        names = [f"upperarm.{side}", f"wing.1.{side}", f"wing.2.{side}"]
        tube(rig, names, wing, WING)
    fan: list[Part] = [((0.06 * k, 0.58, height), (0.05, 0.14, 0.008), WING) for k in (-1, 0, 1)]
    eyes: list[Part] = [((0.04 * s, -0.035, height + 0.03), (0.012,) * 3, DARK) for s in (-1, 1)]
    beak: list[Part] = [((0.0, -0.1, height - 0.005), (0.015, 0.05, 0.012), BEAK)]
    carry(rig, "body", fan + eyes + beak)
    cycle(rig, {f"upperarm.{side}": (0.6, 0.0, 0.0) for side in sides}, rounds=2)
    return rig


def bear() -> Any:
    """A bear that hops twice; its belly has a bone of its own."""
    bones = {
        "body": ((0.0, 0.05, 0.3), (0.0, 0.05, 0.9)),
        "belly": ((0.0, 0.0, 0.52), (0.0, -0.48, 0.45)),
    }
    rig = armature("bear", bones)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=32, location=(0.0, 0.0, 0.6))
    skin = bpy.context.object
    skin.data.materials.append(paint(BROWN))
    skin.data.shade_smooth()
    skin.parent = rig
    skin.matrix_parent_inverse.translation = (0.0, 0.0, 0.0)
    groups = {name: skin.vertex_groups.new(name=name) for name in bones}
    for number, vertex in enumerate(skin.data.vertices):
        x, y, z = vertex.co
        front = max(1.0 - (x / 0.85) ** 2 - ((z + 0.25) / 0.7) ** 2, 0.0) ** 0.5 * max(-y, 0.0)
        vertex.co = 0.33 * x, 0.28 * y - 0.28 * front, 0.42 * z
        share = float(np.clip(2.5 * front - 0.5, 0.0, 1.0))
        for name, own in (("belly", share), ("body", 1.0 - share)):
            if own > 0.0:
                groups[name].add([number], own, "REPLACE")
    skin.modifiers.new("Armature", "ARMATURE").object = rig
    parts: list[Part] = [
        ((0.0, -0.02, 1.13), (0.23, 0.22, 0.21), BROWN),
        ((0.0, -0.22, 1.08), (0.11, 0.1, 0.08), PALE),
        ((0.0, -0.32, 1.11), (0.035, 0.03, 0.025), DARK),
    ]
    for side in (-1.0, 1.0):
        parts += [
            ((0.17 * side, 0.0, 1.3), (0.08, 0.04, 0.08), BROWN),
            ((0.08 * side, -0.21, 1.19), (0.025, 0.02, 0.03), DARK),
            ((0.36 * side, -0.05, 0.72), (0.09, 0.1, 0.22), BROWN),
            ((0.17 * side, 0.0, 0.16), (0.11, 0.14, 0.16), BROWN),
        ]
    carry(rig, "body", parts)
    root = rig.pose.bones["body"]
    for frame in range(1, 2 + PERIOD):
        root.location = 0.0, HOP * (0.5 - 0.5 * cos(4.0 * pi * (frame - 1) / PERIOD)), 0.0
        root.keyframe_insert("location", frame=frame)
    return rig


def chain(names: Sequence[str], joints: Sequence[Point]) -> list[tuple[str, tuple[Point, Point]]]:
    """Bones from joint to joint, by name."""
    return [*zip(names, pairwise(joints), strict=True)]


def armature(
    name: str, bones: Mapping[str, tuple[Point, Point]], above: Mapping[str, str] | None = None
) -> Any:
    """An armature in the scene: each bone below the one before it, or below that of `above`."""
    data = bpy.data.armatures.new(name)
    rig = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    parent = None
    for bone, (head, tail) in bones.items():
        edited = data.edit_bones.new(bone)
        edited.head, edited.tail = head, tail
        edited.align_roll((0.0, 0.0, 1.0))
        edited.parent = data.edit_bones.get((above or {}).get(bone, ""), parent)
        parent = edited
    bpy.ops.object.mode_set(mode="OBJECT")
    return rig


def tube(
    rig: Any, bones: Sequence[str], rings: Sequence[tuple[Point, Point, Point]], colour: Colour
) -> None:
    """A closed tube of ellipses, each a centre and two half axes, bound to bones along it."""
    angles = np.linspace(0.0, 2.0 * pi, AROUND, endpoint=False)[:, None]
    centres, first, second = (np.array(each) for each in zip(*rings, strict=True))
    points = np.concatenate(
        [
            c + np.cos(angles) * u + np.sin(angles) * v
            for c, u, v in zip(centres, first, second, strict=True)
        ]
    )
    faces: list[tuple[int, ...]] = [
        (ring + a, ring + AROUND + a, ring + AROUND + b, ring + b)
        for ring in range(0, len(points) - AROUND, AROUND)
        for a, b in zip(range(AROUND), [*range(1, AROUND), 0], strict=True)
    ]
    last = len(points) - AROUND
    faces += [tuple(range(AROUND)), tuple(range(len(points) - 1, last - 1, -1))]
    mesh = bpy.data.meshes.new(bones[0])
    mesh.from_pydata(points.tolist(), [], faces)
    edited = bmesh.new()
    edited.from_mesh(mesh)
    bmesh.ops.recalc_face_normals(edited, faces=edited.faces)
    edited.to_mesh(mesh)
    mesh.shade_smooth()
    mesh.materials.append(paint(colour))
    skin = bpy.data.objects.new(bones[0], mesh)
    bpy.context.scene.collection.objects.link(skin)
    skin.parent = rig
    heads = [np.array(rig.data.bones[bone].head_local) for bone in bones]
    ends = [*heads, np.array(rig.data.bones[bones[-1]].tail_local)]
    lengths = [float(np.linalg.norm(high - low)) for low, high in pairwise(ends)]
    starts, blend = np.cumsum([0.0, *lengths]), BLEND * np.mean(lengths)
    way = (ends[-1] - ends[0]) / np.linalg.norm(ends[-1] - ends[0])
    for number, bone in enumerate(bones):
        group = skin.vertex_groups.new(name=bone)
        for vertex, place in enumerate(np.repeat((centres - ends[0]) @ way, AROUND)):
            before = (place - starts[number]) / blend + 0.5 if number else 1.0
            after = (starts[number + 1] - place) / blend + 0.5 if number < len(bones) - 1 else 1.0
            if min(before, after) > 0.0:
                group.add([vertex], min(1.0, before, after), "REPLACE")
    skin.modifiers.new("Armature", "ARMATURE").object = rig
    skin.modifiers.new("Smooth", "SUBSURF").levels = 1


def carry(rig: Any, bone: str, parts: Sequence[Part]) -> None:
    """Ellipsoids that move with a bone."""
    for centre, size, colour in parts:
        bpy.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=10, location=centre)
        part = bpy.context.object
        part.scale = size
        part.data.materials.append(paint(colour))
        part.data.shade_smooth()
        bpy.context.view_layer.update()
        where = part.matrix_world.copy()
        part.parent, part.parent_type, part.parent_bone = rig, "BONE", bone
        bpy.context.view_layer.update()
        part.matrix_world = where


def cycle(rig: Any, swings: Mapping[str, tuple[float, float, float]], rounds: int = 1) -> None:
    """Keys of a cycle: amplitudes about the x and z axes of bones, and a phase, rad."""
    for frame in range(1, 2 + PERIOD):
        angle = 2.0 * pi * rounds * (frame - 1) / PERIOD
        for name, (nod, sway, phase) in swings.items():
            bone = rig.pose.bones[name]
            bone.rotation_mode = "XYZ"
            bone.rotation_euler = nod * sin(angle), 0.0, sway * sin(angle + phase)
            bone.keyframe_insert("rotation_euler", frame=frame)


def paint(colour: Colour) -> Any:
    """A matt material."""
    name = "-".join(f"{part:.2f}" for part in colour)
    if name in bpy.data.materials:
        return bpy.data.materials[name]
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    shader = material.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*colour, 1.0)
    shader.inputs["Roughness"].default_value = 0.7
    return material
