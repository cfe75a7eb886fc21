"""Checks of a whole glTF document, before any part of it is used.

source  Khronos glTF 2.0 specification, sections 3.5 (nodes), 3.7 (meshes, skins) and 3.11
        (animations)
"""

from __future__ import annotations

from collections.abc import Iterator
from math import hypot

import numpy as np

from flowborne.base.errors import SceneError
from flowborne.characters.gltf_buffers import Accessors, within, wrong
from flowborne.characters.gltf_document import Document, Primitive, Sampler, Skin
from flowborne.characters.rig import Array

MAX_NODES = 10_000

TRIANGLES = 4
FLOATS, INDICES, JOINTS = (5126,), (5121, 5123, 5125), (5121, 5123)
PARTS = (5120, 5121, 5122, 5123, 5126)
"""Component types: floats, integers, and floats or normalized integers."""

WIDTH = {"translation": "VEC3", "rotation": "VEC4", "scale": "VEC3"}
"""Path of a channel -> type of its values."""


def check_document(name: str, document: Document, arrays: Accessors) -> None:
    """Raise SceneError if tables or numbers of a document contradict each other.

    name    of the file, for messages
    arrays  of the document
    """
    check_tree(name, document)
    for number, skin in enumerate(document.skins):
        _check_skin(skin, len(document.nodes), arrays, f"{name}, skins[{number}]")
    checked = set[tuple[int, int]]()
    for number, node in enumerate(document.nodes):
        where = f"{name}, nodes[{number}]"
        if node.mesh is None:
            continue
        within(node.mesh, document.meshes, f"{where}.mesh", "meshes")
        if node.skin is None:
            continue
        within(node.skin, document.skins, f"{where}.skin", "skins")
        joints = len(document.skins[node.skin].joints)
        if (node.mesh, joints) in checked:
            continue
        checked.add((node.mesh, joints))
        for part, primitive in enumerate(document.meshes[node.mesh].primitives):
            own = f"{name}, meshes[{node.mesh}].primitives[{part}]"
            _check_part(primitive, joints, arrays, own, node.name)
    for number, animation in enumerate(document.animations):
        where = f"{name}, animations[{number}]"
        for k, channel in enumerate(animation.channels):
            own = f"{where}.channels[{k}]"
            within(channel.sampler, animation.samplers, f"{own}.sampler", "samplers in this clip")
            if channel.target.node is None or channel.target.path not in WIDTH:
                continue
            within(channel.target.node, document.nodes, f"{own}.target.node", "nodes")
            sampler = animation.samplers[channel.sampler]
            own = f"{where}.samplers[{channel.sampler}]"
            _check_sampler(sampler, channel.target.path, arrays, own)


def check_tree(name: str, document: Document) -> None:
    """Raise SceneError unless every node has at most one parent and none is its own ancestor."""
    nodes = document.nodes
    if len(nodes) > MAX_NODES:
        raise SceneError(
            f"{name} has {len(nodes)} nodes; the maximum is {MAX_NODES}. Export the character "
            "alone."
        )
    parents = [-1] * len(nodes)
    for number, node in enumerate(nodes):
        for child in node.children:
            within(child, nodes, f"{name}, nodes[{number}].children", "nodes")
            if parents[child] >= 0:
                raise wrong(
                    f"{name}, nodes[{child}] is a child of nodes[{parents[child]}] and of "
                    f"nodes[{number}]"
                )
            parents[child] = number
        if not 1e-6 < (length := hypot(*node.rotation)) < 1e6:
            where = f"{name}, nodes[{number}].rotation"
            raise wrong(f"{where} is not a unit quaternion: it has length {length:.3g}")
    pending = [number for number, parent in enumerate(parents) if parent < 0]
    reached = set(pending)
    while pending:
        below = nodes[pending.pop()].children
        reached.update(below)
        pending += below
    if lost := sorted(set(range(len(nodes))) - reached):
        raise wrong(f"{name}, nodes[{lost[0]}] is its own descendant")


def _check_skin(skin: Skin, nodes: int, arrays: Accessors, where: str) -> None:
    for joint in skin.joints:
        within(joint, range(nodes), f"{where}.joints", "nodes")
    if len(set(skin.joints)) < len(skin.joints):
        raise wrong(f"{where}.joints has a joint twice")
    if skin.inverse_bind_matrices is None:
        raise SceneError(
            f"{where} ('{skin.name}') has no inverse bind matrices. Export it with the mesh bound "
            "to the armature."
        )
    own = f"{where}.inverseBindMatrices"
    matrices = _numbers(skin.inverse_bind_matrices, arrays, "MAT4", FLOATS, own)
    if len(matrices) < len(skin.joints):
        raise wrong(f"{own} has {len(matrices)} matrices for {len(skin.joints)} joints")
    matrices = matrices.reshape(-1, 4, 4).swapaxes(1, 2)[: len(skin.joints)]
    with np.errstate(all="ignore"):
        volumes = np.linalg.det(matrices[:, :3, :3])
    for joint, (matrix, volume) in enumerate(zip(matrices, volumes, strict=True)):
        if not np.allclose(matrix[3], (0.0, 0.0, 0.0, 1.0), atol=1e-6):
            raise wrong(f"{own}: matrix {joint} does not end with the row 0 0 0 1")
        if not 1e-30 < abs(volume) < 1e30:
            raise wrong(f"{own}: matrix {joint} has no inverse (its determinant is {volume:.3g})")


def _check_part(part: Primitive, joints: int, arrays: Accessors, where: str, node: str) -> None:
    if part.mode != TRIANGLES:
        raise SceneError(
            f"{where}: a mesh of '{node}' is not made of triangles. Triangulate it before "
            "exporting."
        )
    if "POSITION" not in part.attributes:
        raise wrong(f"{where}.attributes has no POSITION")
    own = f"{where}.attributes.POSITION"
    points = len(_numbers(part.attributes["POSITION"], arrays, "VEC3", FLOATS, own))
    corners = points
    if part.indices is not None:
        own = f"{where}.indices"
        _check_kind(part.indices, arrays, "SCALAR", INDICES, own)
        corners = len(arrays.indices(part.indices, points, own, "points"))
    if corners % 3:
        raise wrong(f"{where} has {corners} corners, not a multiple of 3")
    if "JOINTS_0" not in part.attributes:
        raise SceneError(
            f"{where}: a mesh of '{node}' has no JOINTS_0. Export it with its weights."
        )
    for number, weight in joint_sets(part):
        for attribute in (number, weight):
            if attribute not in part.attributes:
                raise wrong(f"{where}.attributes has no {attribute}")
        own = f"{where}.attributes.{number}"
        _check_kind(part.attributes[number], arrays, "VEC4", JOINTS, own)
        if len(arrays.indices(part.attributes[number], joints, own, "joints")) != points:
            raise wrong(f"{own} has another number of elements than the {points} points")
        own = f"{where}.attributes.{weight}"
        weights = _numbers(part.attributes[weight], arrays, "VEC4", PARTS, own)
        if len(weights) != points:
            raise wrong(f"{own} has another number of elements than the {points} points")
        if weights.min() < 0.0:
            raise wrong(
                f"{own} has a weight of {weights.min():.3g}, but weights must be at least 0"
            )


def joint_sets(part: Primitive) -> Iterator[tuple[str, str]]:
    """Names of the attributes of joints and weights, four of each for a vertex."""
    number = 0
    while f"JOINTS_{number}" in part.attributes:
        yield f"JOINTS_{number}", f"WEIGHTS_{number}"
        number += 1


def _check_sampler(sampler: Sampler, path: str, arrays: Accessors, where: str) -> None:
    times = _numbers(sampler.input, arrays, "SCALAR", FLOATS, f"{where}.input").ravel()
    if (np.diff(times) <= 0.0).any():
        raise wrong(f"{where}.input: the times of its keys do not increase")
    values = _numbers(sampler.output, arrays, WIDTH[path], PARTS, f"{where}.output")
    keys = len(times) * (3 if sampler.interpolation == "CUBICSPLINE" else 1)
    if len(values) != keys:
        raise wrong(f"{where}.output has {len(values)} values for {len(times)} keys, not {keys}")
    own = values[1::3] if sampler.interpolation == "CUBICSPLINE" else values
    if path == "rotation" and not np.any(own, axis=1).all():
        raise wrong(f"{where}.output has a quaternion of length 0")


def _numbers(
    number: int, arrays: Accessors, type_: str, kinds: tuple[int, ...], where: str
) -> Array:
    """(count, width) the elements of an accessor of the right type, all finite."""
    _check_kind(number, arrays, type_, kinds, where)
    return arrays.numbers(number, where)


def _check_kind(
    number: int, arrays: Accessors, type_: str, kinds: tuple[int, ...], where: str
) -> None:
    within(number, arrays, where, "accessors")
    accessor = arrays.table(number)
    if accessor.type != type_ or accessor.component_type not in kinds:
        raise wrong(
            f"{where} (accessors[{number}]) is {accessor.type} of components "
            f"{accessor.component_type}, not {type_} of {' or '.join(map(str, kinds))}"
        )
