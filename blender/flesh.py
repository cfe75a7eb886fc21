# SPDX-License-Identifier: GPL-3.0-or-later
"""The flesh of a run on the meshes of a character, by a modifier in front of the armature's.

A vertex that flesh bones carry moves with the nearest triangle of the flesh at rest. What it moves
is the offset from its place before the armature deforms it, so that the armature deforms it to its
place in the run. Shape keys of the mesh add to this offset.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix
from mathutils.bvhtree import BVHTree

from .character import in_frames, meshes_of
from .motion import Array, Integers, Motion, MotionError, Skin
from .nodes import add_node
from .stand_in import FLESH, parents_of, remove_flesh


def add_flesh(
    context: Any,
    armature: Any,
    motion: Motion,
    skin: Skin,
    bones: Sequence[str],
    first: int,
    unit: float,
) -> list[Any]:
    """Let the flesh of a run move the visible meshes of an armature; those that it moves.

    motion  of the bones, and `skin` of the flesh, in the frames from `first` of Blender on
    bones   around which the flesh is
    unit    m per unit of Blender
    raises  MotionError when the meshes have no vertices of these bones
    """
    missing = [name for name in (*bones, skin.body) if name not in armature.data.bones]
    if missing:
        raise MotionError(
            f"armature '{armature.name}' has no bone '{missing[0]}' of the run: rename it back"
        )
    found, carried = [], _carried(armature, motion, bones)
    for _ in in_frames(context, [first]):
        flesh = _Flesh(armature, motion, skin, unit)
        for mesh in meshes_of(context, armature):
            if not carried & {*mesh.vertex_groups.keys()}:
                continue
            points, weights = _before_armature(context, mesh, [*flesh.skinning])
            share = weights[:, [name in carried for name in flesh.skinning]].sum(axis=1)
            chosen = np.flatnonzero(share)
            if chosen.size:
                offsets = share[chosen, None] * flesh.offsets(mesh, points[chosen], weights[chosen])
                found.append((mesh, len(points), chosen, offsets))
    if not found:
        raise MotionError(
            f"no visible mesh of armature '{armature.name}' has weights for {', '.join(bones)}: "
            "show or select the mesh that was run"
        )
    for each in found:
        _add_modifier(*each, first)
    return [mesh for mesh, *_ in found]


class _Flesh:
    """The flesh of a run in the axes and the unit of an armature, which is where it is at first.

    back       (4, 4) from the world's axes to those of the armature
    skinning   bone -> (frames, 4, 4) from its rest pose to its pose
    rest       (k, 3) vertices
    vertices   (frames, k, 3)
    """

    def __init__(self, armature: Any, motion: Motion, skin: Skin, unit: float) -> None:
        bones, place = armature.data.bones, np.array(armature.matrix_world)
        places, self.back = np.tile(place, (len(motion.position), 1, 1)), np.linalg.inv(place)
        self.skinning = {
            name: motion.in_armature(name, unit, places) @ np.linalg.inv(bones[name].matrix_local)
            for name in motion.names
            if name in bones
        }
        scale, bone = np.linalg.norm(place[:3, 0]), np.array(bones[skin.body].matrix_local)
        self.rest = skin.rest / (unit * scale) @ bone[:3, :3].T + bone[:3, 3]
        self.vertices = skin.vertices / unit @ self.back[:3, :3].T + self.back[:3, 3]
        self.triangles = skin.triangles

    def offsets(self, mesh: Any, points: Array, weights: Array) -> Array:
        """(frames, n, 3) by which to move points so that the armature brings them to the flesh.

        points   (n, 3) in the axes of their mesh
        weights  (n, b) of the bones
        """
        axes = self.back @ np.array(mesh.matrix_world)
        keeps = mesh.modifiers[_number(mesh)].use_deform_preserve_volume
        at_rest = points @ axes[:3, :3].T + axes[:3, 3]
        tree = BVHTree.FromPolygons(self.rest.tolist(), self.triangles.tolist())
        nearest = [tree.find_nearest(point)[2] for point in at_rest.tolist()]
        corners = self.triangles[nearest]
        start, frame = _frames(self.rest[corners])
        local = np.linalg.solve(frame, (at_rest - start)[..., None])
        found = []
        for number, vertices in enumerate(self.vertices):
            start, frame = _frames(vertices[corners])
            goal = start + (frame @ local)[..., 0]
            poses = np.array([each[number] for each in self.skinning.values()])
            skinning = _blended(weights, poses, keeps)
            back = np.linalg.solve(skinning[:, :3, :3], (goal - skinning[:, :3, 3])[..., None])
            found.append(back[..., 0] - at_rest)
        return np.array(found) @ np.linalg.inv(axes[:3, :3]).T


def _frames(corners: Array) -> tuple[Array, Array]:
    """First corner (n, 3), and (n, 3, 3) the edges from it and the normal of triangles."""
    start, one, other = np.moveaxis(corners, 1, 0)
    one, other = one - start, other - start
    normal = np.cross(one, other)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(float).tiny)
    return start, np.stack([one, other, normal], axis=2)


def _blended(weights: Array, poses: Array, keeps: bool) -> Array:
    """(n, 4, 4) what an armature does with vertices of weights (n, b) of bones at poses (b, 4, 4).

    source  for `keeps`: Kavan et al. 2008, dual quaternions
    """
    if not keeps:
        return np.asarray(np.einsum("nb,bij->nij", weights, poses))
    turns = np.array([Matrix(pose).to_quaternion() for pose in poses])
    shifts = np.concatenate([np.zeros((len(poses), 1)), poses[:, :3, 3]], axis=1)
    main = turns[weights.argmax(axis=1)]
    signed = weights * np.where(main @ turns.T < 0.0, -1.0, 1.0)
    turn, dual = signed @ turns, signed @ (0.5 * _product(shifts, turns))
    size = np.linalg.norm(turn, axis=1, keepdims=True)
    turn, dual = turn / size, dual / size
    found = np.tile(np.eye(4), (len(weights), 1, 1))
    back = turn * [1.0, -1.0, -1.0, -1.0]
    found[:, :3, 3] = 2.0 * _product(dual, back)[:, 1:]
    for axis, unit in enumerate(np.eye(4)[1:]):
        found[:, :3, axis] = _product(_product(turn, unit[None]), back)[:, 1:]
    return found


def _product(one: Array, other: Array) -> Array:
    """Quaternions (n, 4), real part first."""
    a, u, b, v = one[:, :1], one[:, 1:], other[:, :1], other[:, 1:]
    real = a * b - (u * v).sum(axis=1, keepdims=True)
    return np.concatenate([real, a * v + b * u + np.cross(u, v)], axis=1)


def _carried(armature: Any, motion: Motion, bones: Sequence[str]) -> set[str]:
    """These bones, and those that are rigid with them."""
    parents = parents_of(armature.data.bones)

    def owner(name: str) -> str:
        while name and name not in motion.moving:
            name = parents[name]
        return name

    return {name for name in parents if owner(name) in bones}


def _before_armature(context: Any, mesh: Any, bones: list[str]) -> tuple[Array, Array]:
    """(n, 3) vertices of a mesh in this frame before its armature deforms it, and (n, b) their
    weights of bones, with sum 1. Raises MotionError without an Armature modifier."""
    number, copy = _number(mesh), mesh.copy()
    context.scene.collection.objects.link(copy)
    try:
        for modifier in [*copy.modifiers][number:]:
            copy.modifiers.remove(modifier)
        remove_flesh(copy)
        evaluated = copy.evaluated_get(context.evaluated_depsgraph_get()).to_mesh()
        points = np.empty(3 * len(evaluated.vertices), np.float32)
        evaluated.vertices.foreach_get("co", points)
        column = {group.index: bones.index(group.name) for group in _groups(mesh, bones)}
        weights = np.zeros((len(evaluated.vertices), len(bones)))
        for vertex, row in zip(evaluated.vertices, weights, strict=True):
            for each in vertex.groups:
                if each.group in column:
                    row[column[each.group]] = each.weight
    finally:
        bpy.data.objects.remove(copy)
    total = weights.sum(axis=1, keepdims=True)
    return points.reshape(-1, 3).astype(float), weights / np.where(total > 0.0, total, 1.0)


def _groups(mesh: Any, bones: list[str]) -> Iterator[Any]:
    return (group for group in mesh.vertex_groups if group.name in bones)


def _number(mesh: Any) -> int:
    """The place of the first Armature modifier. Raises MotionError without one."""
    for number, modifier in enumerate(mesh.modifiers):
        if modifier.type == "ARMATURE":
            return number
    raise MotionError(
        f"mesh '{mesh.name}' is bound to the armature by its parent: give it an Armature modifier "
        "(Object, Parent, Armature Deform)"
    )


def _add_modifier(mesh: Any, count: int, chosen: Integers, offsets: Array, first: int) -> None:
    """Add the modifier that moves some vertices of a mesh, in front of the armature's and in place
    of an earlier one of ours.

    count    of the vertices of the mesh
    chosen   (n,) numbers of vertices
    offsets  (frames, n, 3)
    first    frame of Blender at which they start
    """
    rows = np.zeros((max(count, offsets.size // 3), 3), np.float32)
    rows[: offsets.size // 3] = offsets.reshape(-1, 3)
    numbers = np.full(len(rows), -1, np.int32)
    numbers[chosen] = np.arange(len(chosen))
    data = bpy.data.meshes.new(FLESH)
    data.vertices.add(len(rows))
    data.vertices.foreach_set("co", rows.ravel())
    data.attributes.new("number", "INT", "POINT").data.foreach_set("value", numbers)
    carrier = bpy.data.objects.new(FLESH, data)
    remove_flesh(mesh)
    place, modifier = _number(mesh), mesh.modifiers.new(FLESH, "NODES")
    modifier.node_group = _nodes(carrier, count, offsets.shape, first)
    mesh.modifiers.move(len(mesh.modifiers) - 1, place)


def _nodes(carrier: Any, count: int, shape: tuple[int, ...], first: int) -> Any:
    """A group of nodes that adds the offsets of the present frame, linear between frames.

    carrier  object of which each point is an offset, frame after frame; its attribute `number` is
             that of a vertex in a frame, -1 for one without an offset
    count    of the vertices of the mesh; another mesh is not moved
    shape    number of frames, and of offsets in each
    """
    group = bpy.data.node_groups.new(FLESH, "GeometryNodeTree")
    group.is_modifier = True
    new_socket = group.interface.new_socket
    new_socket("Mesh", in_out="INPUT", socket_type="NodeSocketGeometry")
    strength = new_socket("Strength", in_out="INPUT", socket_type="NodeSocketFloat")
    strength.default_value, strength.min_value, strength.max_value = 1.0, 0.0, 1.0
    new_socket("Mesh", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    add = partial(add_node, group)

    def math(operation: str, *inputs: Any) -> Any:
        return add("ShaderNodeMath", *inputs, operation=operation).outputs[0]

    def vector(operation: str, *inputs: Any) -> Any:
        return add("ShaderNodeVectorMath", *inputs, operation=operation).outputs[0]

    def sample(kind: str, value: Any, index: Any) -> Any:
        return add("GeometryNodeSampleIndex", offsets, value, index, data_type=kind).outputs[0]

    given = add("NodeGroupInput").outputs
    offsets = add("GeometryNodeObjectInfo", carrier).outputs["Geometry"]
    named = add("GeometryNodeInputNamedAttribute", "number", data_type="INT").outputs[0]
    number = sample("INT", named, add("GeometryNodeInputIndex").outputs[0])
    last, time = shape[0] - 1, add("GeometryNodeInputSceneTime").outputs["Frame"]
    passed = add("ShaderNodeClamp", math("SUBTRACT", time, first), 0.0, last).outputs[0]
    before = math("FLOOR", passed)
    after, position = math("CEIL", passed), add("GeometryNodeInputPosition").outputs[0]
    start, end = (
        sample(
            "FLOAT_VECTOR",
            position,
            add(
                "FunctionNodeIntegerMath", frame, shape[1], number, operation="MULTIPLY_ADD"
            ).outputs[0],
        )
        for frame in (before, after)
    )
    moved = vector("MULTIPLY_ADD", vector("SUBTRACT", end, start), math("FRACT", passed), start)
    points = add("GeometryNodeAttributeDomainSize", given[0]).outputs["Point Count"]
    same = add("FunctionNodeCompare", points, count, data_type="INT", operation="EQUAL")
    has = add("FunctionNodeCompare", number, 0, data_type="INT", operation="GREATER_EQUAL")
    chosen = add("FunctionNodeBooleanMath", same.outputs[0], has.outputs[0]).outputs[0]
    scaled = add("ShaderNodeVectorMath", moved, operation="SCALE")
    group.links.new(given[1], scaled.inputs["Scale"])
    result = add("GeometryNodeSetPosition", given[0], chosen, None, scaled.outputs[0])
    add("NodeGroupOutput", result.outputs[0])
    return group
