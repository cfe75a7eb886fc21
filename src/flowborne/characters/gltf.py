"""Skins, weights and animations of glTF 2.0.

source  Khronos glTF 2.0 specification, sections 3.6 (accessors), 3.7.3 (skins), 3.11 and appendix C
        (animations)
"""

from __future__ import annotations

from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from flowborne.base.errors import SceneError
from flowborne.characters.gltf_buffers import Accessors, Colours
from flowborne.characters.gltf_document import Node, Primitive, Skin, read_document
from flowborne.characters.gltf_gate import WIDTH, check_document, joint_sets
from flowborne.characters.limits import check_size
from flowborne.characters.rig import (
    Z_UP,
    Action,
    Array,
    Integers,
    Rig,
    Surface,
    frame_times,
    joined,
    normalised,
    one_tree,
    own_names,
    placed,
    sampled_action,
    unique_names,
)

PACKED = ("KHR_draco_mesh_compression", "EXT_meshopt_compression")
"""Extensions that compress the arrays."""

Curve = tuple[Array, Array, str]
"""Times (k,) s, values (k or 3 k, m) and the kind of interpolation."""


class GltfSource:
    """A file's skeleton, surface and clips.

    raises  SceneError when it cannot be read, has no joints, or is compressed
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
        check_document(path.name, self._gltf, self._arrays)
        self._colours = Colours(path.name, self._gltf, self._arrays, buffers)
        self._parents = [-1] * len(self._gltf.nodes)
        for number, node in enumerate(self._gltf.nodes):
            for child in node.children:
                self._parents[child] = number
        self._order = self._parents_first()
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
        for skin in self._gltf.skins:
            inner = self._into_world(skin)
            for node, inverse in zip(skin.joints, self._inverse_binds(skin), strict=True):
                bind[number[node]] = inner @ np.linalg.inv(inverse)
        return Rig(names, one_tree(parents), *placed(bind, f"{self._name}, joints at rest"))

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
            inner = self._into_world(skin)
            own = np.array([self._number[joint] for joint in skin.joints])
            for part in self._gltf.meshes[node.mesh].primitives:
                points = self._arrays.read(part.attributes["POSITION"]).astype(float)
                corners = np.arange(len(points))
                if part.indices is not None:
                    corners = self._arrays.read(part.indices).ravel().astype(np.int64)
                triangles = corners.reshape(-1, 3)
                if np.linalg.det(inner[:3, :3]) < 0.0:
                    triangles = triangles[:, ::-1]
                vertices = points @ inner[:3, :3].T + inner[:3, 3]
                weights = self._weights(part, own, len(points))
                colours = self._colours.of(part, triangles, len(points))
                found.append(Surface(vertices, triangles, weights, colours))
        return joined(found, self._name)

    @property
    def left_out(self) -> tuple[str, ...]:
        """Names of the nodes whose mesh has no skin."""
        nodes = enumerate(self._gltf.nodes)
        bare = [(k, node) for k, node in nodes if node.mesh is not None and node.skin is None]
        return tuple(node.name or f"nodes[{k}]" for k, node in bare)

    def _points(self, node: Node) -> int:
        """Number of vertices of a node's mesh."""
        assert node.mesh is not None
        parts = self._gltf.meshes[node.mesh].primitives
        return sum(self._arrays.table(part.attributes["POSITION"]).count for part in parts)

    @np.errstate(all="ignore")
    def action(self, clip: int) -> Action:
        """The `clip`-th animation, sampled at its own rate.

        raises  SceneError when it moves no joint
        """
        animation = self._gltf.animations[clip]
        curves: dict[tuple[int, str], Curve] = {}
        for channel in animation.channels:
            if channel.target.node is None or channel.target.path not in WIDTH:
                continue
            sampler = animation.samplers[channel.sampler]
            times = self._arrays.read(sampler.input).ravel().astype(float)
            values = self._arrays.read(sampler.output).astype(float)
            curves[channel.target.node, channel.target.path] = times, values, sampler.interpolation
        if not curves:
            raise SceneError(f"{self._name}: clip '{self.clips[clip]}' moves no joint.")
        keys = [times for times, _, _ in curves.values()]
        where = f"{self._name}, clip '{self.clips[clip]}'"
        nodes = len(self._gltf.nodes)
        times = frame_times(np.concatenate(keys), max(keys, key=len), nodes, where)
        try:
            world = self._worlds(times, curves)[:, self._joints]
        except ValueError as error:  # a spline of quaternions goes through 0
            raise SceneError(f"{where} has a quaternion of length 0. Export it again.") from error
        return sampled_action(times, world, where)

    @cached_property
    def _rest(self) -> Array:
        """(nodes, 4, 4) frame of every node to the world's, without a clip."""
        return self._worlds(np.zeros(1), {})[0]

    def _parents_first(self) -> list[int]:
        order, pending = [], [n for n, parent in enumerate(self._parents) if parent < 0]
        while pending:
            node = pending.pop(0)
            order.append(node)
            pending = [*(self._gltf.nodes[node].children), *pending]
        return order

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

    def _into_world(self, skin: Skin) -> Array:
        """(4, 4) frame of a skin's meshes to the world's, from its first joint at rest."""
        first = min(range(len(skin.joints)), key=lambda n: self._order.index(skin.joints[n]))
        return np.asarray(self._rest[skin.joints[first]] @ self._inverse_binds(skin)[first])

    def _inverse_binds(self, skin: Skin) -> Array:
        """(joints, 4, 4) frame of a skin's meshes to each joint's."""
        assert skin.inverse_bind_matrices is not None
        columns = self._arrays.read(skin.inverse_bind_matrices)[: len(skin.joints)].astype(float)
        return columns.reshape(-1, 4, 4).swapaxes(1, 2)

    def _weights(self, part: Primitive, joints: Integers, count: int) -> Array:
        """(count, n) weights of all joints."""
        shares = np.zeros((count, len(self._joints)))
        for number, weight in joint_sets(part):
            own = joints[self._arrays.read(part.attributes[number]).astype(np.int64)]
            weights = self._arrays.read(part.attributes[weight]).astype(float)
            np.add.at(shares, (np.arange(count)[:, None], own), weights)
        return normalised(shares, int(joints[0]))


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
