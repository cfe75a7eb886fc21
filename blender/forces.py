# SPDX-License-Identifier: GPL-3.0-or-later
"""The forces of air or water on bodies as points with attributes, drawn by geometry nodes.

There is a point for each body and frame, where the force acts. Its attributes are `force` (N, a
vector), `frame`, and `bone` (its number in the armature). The node group keeps the points of the
present frame, and puts arrows on them.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import bpy
import numpy as np

from .motion import Motion
from .nodes import add_node

NAME = "flowborne forces"

LONGEST = 0.5
"""Length of the longest arrow, in sizes of the armature."""


def add_forces(context: Any, armature: Any, motion: Motion, first: int, unit: float) -> Any:
    """A new object in the scene with the forces of a motion.

    first  frame of Blender at which the motion starts
    unit   m per unit of Blender
    """
    bones = armature.data.bones
    kept = [n for n, name in enumerate(motion.names) if motion.force[:, n].any() and name in bones]
    places, forces = motion.centre[:, kept] / unit, motion.force[:, kept]
    frames, own = np.indices(forces.shape[:2])
    numbers = np.array([bones.find(motion.names[n]) for n in kept], int)
    mesh = bpy.data.meshes.new(NAME)
    mesh.from_pydata(places.reshape(-1, 3).tolist(), [], [])
    _attribute(mesh, "force", "FLOAT_VECTOR", "vector", forces)
    _attribute(mesh, "frame", "INT", "value", first + frames)
    _attribute(mesh, "bone", "INT", "value", numbers[own])
    thing = bpy.data.objects.new(f"{NAME} {armature.name}", mesh)
    context.scene.collection.objects.link(thing)
    ends = np.array([[*bone.head_local, *bone.tail_local] for bone in bones]).reshape(-1, 3)
    size = LONGEST * float(np.ptp(ends, axis=0).max()) * armature.matrix_world.median_scale
    largest = float(np.linalg.norm(forces, axis=-1).max(initial=0.0))
    thing.modifiers.new("Arrows", "NODES").node_group = _arrows(size / (largest or 1.0))
    return thing


def _attribute(mesh: Any, name: str, kind: str, field: str, values: Any) -> None:
    mesh.attributes.new(name, kind, "POINT").data.foreach_set(field, values.ravel())


def _arrows(per_newton: float) -> Any:
    """A group of nodes that draws arrows at the points of the present frame."""
    group = bpy.data.node_groups.new(NAME, "GeometryNodeTree")
    new_socket = group.interface.new_socket
    new_socket("Points", in_out="INPUT", socket_type="NodeSocketGeometry")
    length_of = new_socket("Length per N", in_out="INPUT", socket_type="NodeSocketFloat")
    length_of.default_value = per_newton
    new_socket("Arrows", in_out="OUTPUT", socket_type="NodeSocketGeometry")

    node = partial(add_node, group)
    given, result = node("NodeGroupInput"), node("NodeGroupOutput")
    time, now = node("GeometryNodeInputSceneTime"), node("ShaderNodeMath", operation="COMPARE")
    frame = node("GeometryNodeInputNamedAttribute", data_type="INT")
    force = node("GeometryNodeInputNamedAttribute", data_type="FLOAT_VECTOR")
    frame.inputs["Name"].default_value, force.inputs["Name"].default_value = "frame", "force"
    now.inputs[2].default_value = 0.5
    points = node("GeometryNodeSeparateGeometry")
    cone = node("GeometryNodeMeshCone")
    for name, value in (("Vertices", 12), ("Radius Bottom", 0.04), ("Depth", 1.0)):
        cone.inputs[name].default_value = value
    turn = node("FunctionNodeAlignRotationToVector", axis="Z")
    size = node("ShaderNodeVectorMath", operation="LENGTH")
    length = node("ShaderNodeMath", operation="MULTIPLY")
    arrows = node("GeometryNodeInstanceOnPoints")
    for source, target in (
        (time.outputs["Frame"], now.inputs[0]),
        (frame.outputs["Attribute"], now.inputs[1]),
        (given.outputs["Points"], points.inputs["Geometry"]),
        (now.outputs[0], points.inputs["Selection"]),
        (points.outputs["Selection"], arrows.inputs["Points"]),
        (cone.outputs["Mesh"], arrows.inputs["Instance"]),
        (force.outputs["Attribute"], turn.inputs["Vector"]),
        (turn.outputs["Rotation"], arrows.inputs["Rotation"]),
        (force.outputs["Attribute"], size.inputs[0]),
        (size.outputs["Value"], length.inputs[0]),
        (given.outputs["Length per N"], length.inputs[1]),
        (length.outputs[0], arrows.inputs["Scale"]),
        (arrows.outputs["Instances"], result.inputs["Arrows"]),
    ):
        group.links.new(source, target)
    return group
