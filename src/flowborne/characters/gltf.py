"""Skins, weights and animations of glTF 2.0, checked as they are read.

source  Khronos glTF 2.0 specification, sections 3.5 (nodes), 3.6 (accessors), 3.7 (meshes, skins),
        3.11 and appendix C (animations)
"""

from __future__ import annotations

from functools import cached_property
from itertools import count, takewhile
from math import hypot
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from flowborne.base.errors import SceneError
from flowborne.characters.gltf_buffers import Accessors, Colours, within
from flowborne.characters.gltf_document import Node, Primitive, Sampler, Skin, read_document
from flowborne.characters.limits import check_size, wrong
from flowborne.characters.rig import (
    Z_UP,
    Action,
    Rig,
    Surface,
    frame_times,
    joined,
    normalised,
    own_names,
    placed,
    sampled_action,
    unique_names,
)
from flowborne.kernels.arrays import Array, Integers

PACKED = ("KHR_draco_mesh_compression", "EXT_meshopt_compression")
"""Extensions that compress the arrays."""

MAX_NODES = 10_000

TRIANGLES = 4
FLOATS, INDICES, JOINTS = (5126,), (5121, 5123, 5125), (5121, 5123)
PARTS = (5120, 5121, 5122, 5123, 5126)
"""Component types: floats, integers, and floats or normalized integers."""

WIDTH = {"translation": "VEC3", "rotation": "VEC4", "scale": "VEC3"}
"""Path of a channel -> type of its values."""

Curve = tuple[Array, Array, str]
"""Times (k,) s, values (k or 3 k, m) and the kind of interpolation."""


class GltfSource:
    """A file's skeleton, surface and clips.

    raises  SceneError when it cannot be read, contradicts itself, has no joints, or is compressed
    """

    def __init__(self, path: Path) -> None:
        self._name = path.name
        self._gltf, buffers = read_document(path)
        packed = [name for name in PACKED if name in self._gltf.extensions_required]
        if packed:
            raise SceneError(
                f"{path.name} is compressed ({packed[0]}). Export it without compression."
            )
        self._arrays = Accessors(path.name, self._gltf, buffers)
        self._parents = self._checked_parents()
        self._order = self._parents_first()
        self._binds = [self._inverse_binds(number) for number in range(len(self._gltf.skins))]
        self._read_all()
        self._colours = Colours(self._arrays)
        skinned = {joint for skin in self._gltf.skins for joint in skin.joints}
        self._joints = [n for n in self._order if n in skinned or not skinned]
        if not self._joints:
            raise SceneError(f"{path.name} has no joints. Export the armature with it.")
        self._number = {node: joint for joint, node in enumerate(self._joints)}

    @property
    def clips(self) -> tuple[str, ...]:
        """Names of the animations, each once."""
        found = self._gltf.animations
        return unique_names([clip.name or f"animation_{n}" for n, clip in enumerate(found)])

    @cached_property
    @np.errstate(all="ignore")  # `placed` checks the result
    def rig(self) -> Rig:
        """The joints in the pose of their skin's binding; all nodes of a file without a skin."""
        check_size(len(self._joints), 0, self._name)
        names = own_names([self._gltf.nodes[node].name for node in self._joints])
        number = self._number
        parents = []
        for node in self._joints:
            above = self._parents[node]
            while above >= 0 and above not in number:
                above = self._parents[above]
            parents.append(number.get(above, -1))
        bind = self._rest[self._joints].copy()
        for skin, binds in zip(self._gltf.skins, self._binds, strict=True):
            inner = self._into_world(skin, binds)
            for node, inverse in zip(skin.joints, binds, strict=True):
                bind[number[node]] = inner @ np.linalg.inv(inverse)
        return Rig(names, np.array(parents), *placed(bind, f"{self._name}, joints at rest"))

    @property
    @np.errstate(all="ignore")
    def surface(self) -> Surface | None:
        """All skinned meshes as one; None when there is none."""
        found = []
        carried = [n for n in self._gltf.nodes if n.mesh is not None and n.skin is not None]
        check_size(len(self._joints), sum(self._points(node) for node in carried), self._name)
        for node in carried:
            assert node.mesh is not None
            assert node.skin is not None
            skin = self._gltf.skins[node.skin]
            inner = self._into_world(skin, self._binds[node.skin])
            own = np.array([self._number[joint] for joint in skin.joints])
            for number, part in enumerate(self._gltf.meshes[node.mesh].primitives):
                points, triangles, sets = self._read_part(node, number, part)
                if np.linalg.det(inner[:3, :3]) < 0.0:
                    triangles = triangles[:, ::-1]
                vertices = points @ inner[:3, :3].T + inner[:3, 3]
                shares = np.zeros((len(points), len(self._joints)))
                for joints, weights in sets:
                    np.add.at(shares, (np.arange(len(points))[:, None], own[joints]), weights)
                colours = self._colours.of(part, triangles, len(points))
                found.append(Surface(vertices, triangles, normalised(shares, own[0]), colours))
        return joined(found, self._name)

    @property
    def left_out(self) -> tuple[str, ...]:
        """Names of the nodes whose mesh has no skin."""
        nodes = enumerate(self._gltf.nodes)
        bare = [(k, node) for k, node in nodes if node.mesh is not None and node.skin is None]
        return tuple(node.name or f"nodes[{k}]" for k, node in bare)

    @np.errstate(all="ignore")
    def action(self, clip: int) -> Action:
        """The `clip`-th animation, sampled at its own rate.

        raises  SceneError when it moves no joint
        """
        curves = self._curves(clip)
        where = f"{self._name}, clip '{self.clips[clip]}'"
        if not curves:
            raise SceneError(f"{self._name}: clip '{self.clips[clip]}' moves no joint.")
        keys = [times for times, _, _ in curves.values()]
        nodes = len(self._gltf.nodes)
        times = frame_times(np.concatenate(keys), max(keys, key=len), nodes, where)
        try:
            world = self._worlds(times, curves)[:, self._joints]
        except ValueError as error:  # a spline of quaternions goes through 0
            raise wrong(f"{where} has a quaternion of length 0") from error
        return sampled_action(times, world, where)

    @cached_property
    def _rest(self) -> Array:
        """(nodes, 4, 4) frame of every node to the world's, without a clip."""
        return self._worlds(np.zeros(1), {})[0]

    @np.errstate(all="ignore")
    def _worlds(self, times: Array, curves: dict[tuple[int, str], Curve]) -> Array:
        """(frames, nodes, 4, 4) frame of every node to the world's, z up."""
        world = np.empty((len(times), len(self._parents), 4, 4))
        turned = np.eye(4)
        turned[:3, :3] = Z_UP
        for number in self._order:
            node, above = self._gltf.nodes[number], self._parents[number]
            if node.matrix is not None:
                local = np.tile(np.reshape(node.matrix, (4, 4)).T, (len(times), 1, 1))
            else:
                local = _local(node, number, times, curves)
            world[:, number] = (turned if above < 0 else world[:, above]) @ local
        return world

    def _into_world(self, skin: Skin, binds: Array) -> Array:
        """(4, 4) frame of a skin's meshes to the world's, from its first joint at rest."""
        first = min(range(len(skin.joints)), key=lambda n: self._order.index(skin.joints[n]))
        return np.asarray(self._rest[skin.joints[first]] @ binds[first])

    def _points(self, node: Node) -> int:
        """Number of vertices of a node's mesh."""
        assert node.mesh is not None
        parts = self._gltf.meshes[node.mesh].primitives
        return sum(self._gltf.accessors[part.attributes["POSITION"]].count for part in parts)

    def _checked_parents(self) -> list[int]:
        """Parent of every node, -1 without one. Raises SceneError when a node has two."""
        name, nodes = self._name, self._gltf.nodes
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
        return parents

    def _parents_first(self) -> list[int]:
        """All nodes, parents before children. Raises SceneError for a node below itself."""
        order, pending = [], [n for n, parent in enumerate(self._parents) if parent < 0]
        while pending:
            node = pending.pop(0)
            order.append(node)
            pending = [*(self._gltf.nodes[node].children), *pending]
        if lost := sorted(set(range(len(self._parents))) - set(order)):
            raise wrong(f"{self._name}, nodes[{lost[0]}] is its own descendant")
        return order

    def _read_all(self) -> None:
        """Read all skinned meshes and clips. Raises SceneError before any of them is used."""
        known = set[tuple[int, int]]()
        for number, node in enumerate(self._gltf.nodes):
            where = f"{self._name}, nodes[{number}]"
            if node.mesh is None:
                continue
            within(node.mesh, self._gltf.meshes, f"{where}.mesh", "meshes")
            if node.skin is None:
                continue
            within(node.skin, self._gltf.skins, f"{where}.skin", "skins")
            joints = len(self._gltf.skins[node.skin].joints)
            if (node.mesh, joints) not in known:
                known.add((node.mesh, joints))
                for k, part in enumerate(self._gltf.meshes[node.mesh].primitives):
                    self._read_part(node, k, part)
        for clip in range(len(self._gltf.animations)):
            self._curves(clip)

    def _inverse_binds(self, number: int) -> Array:
        """(joints, 4, 4) frame of a skin's meshes to each joint's."""
        skin, where = self._gltf.skins[number], f"{self._name}, skins[{number}]"
        for joint in skin.joints:
            within(joint, self._gltf.nodes, f"{where}.joints", "nodes")
        if len(set(skin.joints)) < len(skin.joints):
            raise wrong(f"{where}.joints has a joint twice")
        if skin.inverse_bind_matrices is None:
            raise SceneError(
                f"{where} ('{skin.name}') has no inverse bind matrices. Export it with the mesh "
                "bound to the armature."
            )
        own = f"{where}.inverseBindMatrices"
        columns = self._arrays.numbers(skin.inverse_bind_matrices, "MAT4", FLOATS, own)
        if len(columns) < len(skin.joints):
            raise wrong(f"{own} has {len(columns)} matrices for {len(skin.joints)} joints")
        matrices = columns.reshape(-1, 4, 4).swapaxes(1, 2)[: len(skin.joints)]
        with np.errstate(all="ignore"):
            volumes = np.linalg.det(matrices[:, :3, :3])
        for joint, (matrix, volume) in enumerate(zip(matrices, volumes, strict=True)):
            if not np.allclose(matrix[3], (0.0, 0.0, 0.0, 1.0), atol=1e-6):
                raise wrong(f"{own}: matrix {joint} does not end with the row 0 0 0 1")
            if not 1e-30 < abs(volume) < 1e30:
                raise wrong(
                    f"{own}: matrix {joint} has no inverse (its determinant is {volume:.3g})"
                )
        return matrices

    def _read_part(
        self, node: Node, number: int, part: Primitive
    ) -> tuple[Array, Integers, list[tuple[Integers, Array]]]:
        """Points (k, 3) and triangles (m, 3) of a part of a node's mesh, and sets of up to four
        joints (k, 4) of its skin with their weights (k, 4)."""
        assert node.skin is not None
        where = f"{self._name}, meshes[{node.mesh}].primitives[{number}]"
        if part.mode != TRIANGLES:
            raise SceneError(
                f"{where}: a mesh of '{node.name}' is not made of triangles. Triangulate it before "
                "exporting."
            )
        given, arrays, joints = part.attributes, self._arrays, self._gltf.skins[node.skin].joints
        if "POSITION" not in given:
            raise wrong(f"{where}.attributes has no POSITION")
        own = f"{where}.attributes.POSITION"
        points = arrays.numbers(given["POSITION"], "VEC3", FLOATS, own)
        corners = np.arange(len(points))
        if part.indices is not None:
            limit = len(points), "points"
            own = f"{where}.indices"
            corners = arrays.indices(part.indices, "SCALAR", INDICES, limit, own).ravel()
        if len(corners) % 3:
            raise wrong(f"{where} has {len(corners)} corners, not a multiple of 3")
        if "JOINTS_0" not in given:
            raise SceneError(
                f"{where}: a mesh of '{node.name}' has no JOINTS_0. Export it with its weights."
            )
        sets = []
        for n in takewhile(lambda n: f"JOINTS_{n}" in given, count()):
            if f"WEIGHTS_{n}" not in given:
                raise wrong(f"{where}.attributes has no WEIGHTS_{n}")
            own = f"{where}.attributes.JOINTS_{n}"
            limit = len(joints), "joints"
            chosen = arrays.indices(given[f"JOINTS_{n}"], "VEC4", JOINTS, limit, own)
            if len(chosen) != len(points):
                raise wrong(f"{own} has another number of elements than the {len(points)} points")
            own = f"{where}.attributes.WEIGHTS_{n}"
            weights = arrays.numbers(given[f"WEIGHTS_{n}"], "VEC4", PARTS, own)
            if len(weights) != len(points):
                raise wrong(f"{own} has another number of elements than the {len(points)} points")
            if weights.min() < 0.0:
                raise wrong(
                    f"{own} has a weight of {weights.min():.3g}, but weights must be at least 0"
                )
            sets.append((chosen, weights))
        return points, corners.reshape(-1, 3), sets

    def _curves(self, clip: int) -> dict[tuple[int, str], Curve]:
        """The curves of an animation, by node and path."""
        animation, where = self._gltf.animations[clip], f"{self._name}, animations[{clip}]"
        curves: dict[tuple[int, str], Curve] = {}
        for k, channel in enumerate(animation.channels):
            own, target = f"{where}.channels[{k}]", channel.target
            within(channel.sampler, animation.samplers, f"{own}.sampler", "samplers in this clip")
            if target.node is None or target.path not in WIDTH:
                continue
            within(target.node, self._gltf.nodes, f"{own}.target.node", "nodes")
            curves[target.node, target.path] = self._read_sampler(
                animation.samplers[channel.sampler],
                target.path,
                f"{where}.samplers[{channel.sampler}]",
            )
        return curves

    def _read_sampler(self, sampler: Sampler, path: str, where: str) -> Curve:
        own = f"{where}.input"
        times = self._arrays.numbers(sampler.input, "SCALAR", FLOATS, own).ravel()
        if (np.diff(times) <= 0.0).any():
            raise wrong(f"{own}: the times of its keys do not increase")
        own, spline = f"{where}.output", sampler.interpolation == "CUBICSPLINE"
        values = self._arrays.numbers(sampler.output, WIDTH[path], PARTS, own)
        if len(values) != (keys := len(times) * (3 if spline else 1)):
            raise wrong(f"{own} has {len(values)} values for {len(times)} keys, not {keys}")
        if path == "rotation" and not np.any(values[1::3] if spline else values, axis=1).all():
            raise wrong(f"{own} has a quaternion of length 0")
        return times, values, sampler.interpolation


def _local(node: Node, number: int, times: Array, curves: dict[tuple[int, str], Curve]) -> Array:
    """(frames, 4, 4) frame of a node to its parent's."""
    rest = {"translation": node.translation, "rotation": node.rotation, "scale": node.scale}
    now = {
        path: _sampled(*curves[number, path], times, turns=path == "rotation")
        if (number, path) in curves
        else np.tile(np.asarray(values, float), (len(times), 1))
        for path, values in rest.items()
    }
    local = np.tile(np.eye(4), (len(times), 1, 1))
    turn = Rotation.from_quat(now["rotation"]).as_matrix()
    local[:, :3, :3] = turn * now["scale"][:, None, :]
    local[:, :3, 3] = now["translation"]
    return local


def _sampled(keys: Array, values: Array, kind: str, times: Array, *, turns: bool) -> Array:
    """(frames, m) values of a curve at some times; `turns` says that they are quaternions."""
    times = np.clip(times, keys[0], keys[-1])
    before = np.clip(np.searchsorted(keys, times, side="right") - 1, 0, max(len(keys) - 2, 0))
    if kind == "CUBICSPLINE":
        arriving, own, leaving = values.reshape(len(keys), 3, -1).swapaxes(0, 1)
    else:
        own = values
    if len(keys) == 1:
        return np.repeat(own, len(times), axis=0)
    if kind == "STEP":
        return np.asarray(own[np.searchsorted(keys, times, side="right") - 1])
    if kind == "LINEAR" and turns:
        return np.asarray(Slerp(keys, Rotation.from_quat(own))(times).as_quat())
    span = (keys[before + 1] - keys[before])[:, None]
    t = (times - keys[before])[:, None] / span
    if kind == "LINEAR":
        return np.asarray((1.0 - t) * own[before] + t * own[before + 1])
    return np.asarray(
        (2.0 * t**3 - 3.0 * t**2 + 1.0) * own[before]
        + span * (t**3 - 2.0 * t**2 + t) * leaving[before]
        + (3.0 * t**2 - 2.0 * t**3) * own[before + 1]
        + span * (t**3 - t**2) * arriving[before + 1]
    )
