"""Skins, weights and animations of glTF 2.0, by pygltflib.

source  Khronos glTF 2.0 specification, sections 3.6 (accessors), 3.7.3 (skins), 3.11 and appendix C
        (animations)
"""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pygltflib as gl
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from flowborne.characters.rig import (
    Z_UP,
    Action,
    Array,
    Integers,
    Rig,
    Surface,
    frame_times,
    one_tree,
    own_names,
    rotations_in,
)
from flowborne.errors import SceneError

KINDS = {
    gl.BYTE: np.int8,
    gl.UNSIGNED_BYTE: np.uint8,
    gl.SHORT: np.int16,
    gl.UNSIGNED_SHORT: np.uint16,
    gl.UNSIGNED_INT: np.uint32,
    gl.FLOAT: np.float32,
}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}

PACKED = ("KHR_draco_mesh_compression", "EXT_meshopt_compression")
"""Extensions that hide the numbers."""

Curve = tuple[Array, Array, str]
"""Times (k,) s, values (k or 3 k, m) and the kind of interpolation."""


class GltfSource:
    """A file's skeleton, surface and clips.

    raises  SceneError when it cannot be read, has no joints, or is compressed
    """

    def __init__(self, path: Path) -> None:
        self._name = path.name
        try:
            self._gltf = gl.GLTF2().load(str(path))
            self._gltf.convert_buffers(gl.BufferFormat.BINARYBLOB)
            self._blob = self._gltf.binary_blob() or b""
        except Exception as error:  # its reader raises whatever goes wrong in it
            raise SceneError(
                f"{path.name} cannot be read as glTF: {error}. Export it anew."
            ) from error
        packed = [name for name in PACKED if name in (self._gltf.extensionsRequired or [])]
        if packed:
            raise SceneError(
                f"{path.name} is compressed ({packed[0]}). Export it without compression."
            )
        self._parents = [-1] * len(self._gltf.nodes)
        for number, node in enumerate(self._gltf.nodes):
            for child in node.children or []:
                self._parents[child] = number
        self._order = self._parents_first()
        skinned = {joint for skin in self._gltf.skins for joint in skin.joints}
        self._joints = [n for n in self._order if n in skinned or not skinned]
        if not self._joints:
            raise SceneError(f"{path.name} has no joints. Export the armature with it.")

    @property
    def clips(self) -> tuple[str, ...]:
        """Names of the animations."""
        found = self._gltf.animations
        return tuple(clip.name or f"animation_{n}" for n, clip in enumerate(found))

    @cached_property
    def rig(self) -> Rig:
        """The joints where their skin is bound to them; every node of a file without a skin."""
        names = own_names([self._gltf.nodes[node].name or "" for node in self._joints])
        number = {node: joint for joint, node in enumerate(self._joints)}
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
        turned = rotations_in(bind[:, :3, :3])
        return Rig(names, one_tree(parents), bind[:, :3, 3], turned)

    @property
    def surface(self) -> Surface | None:
        """All skinned meshes as one; None when there is none."""
        vertices, faces, weights, count = [], [], [], 0
        number = {node: joint for joint, node in enumerate(self._joints)}
        for node in self._gltf.nodes:
            if node.mesh is None or node.skin is None:
                continue
            skin = self._gltf.skins[node.skin]
            inner = self._into_world(skin)
            own = np.array([number[joint] for joint in skin.joints])
            for part in self._gltf.meshes[node.mesh].primitives:
                if part.mode not in (None, gl.TRIANGLES):
                    raise SceneError(
                        f"{self._name}: a mesh of '{node.name}' is not made of triangles. "
                        "Triangulate it before exporting."
                    )
                points = self._array(part.attributes.POSITION).astype(float)
                corners = np.arange(len(points))
                if part.indices is not None:
                    corners = self._array(part.indices).ravel().astype(np.int64)
                triangles = corners.reshape(-1, 3)
                if np.linalg.det(inner[:3, :3]) < 0.0:
                    triangles = triangles[:, ::-1]
                vertices.append(points @ inner[:3, :3].T + inner[:3, 3])
                faces.append(triangles + count)
                weights.append(self._weights(part, own, len(points)))
                count += len(points)
        if not vertices:
            return None
        return Surface(np.concatenate(vertices), np.concatenate(faces), np.concatenate(weights))

    def action(self, clip: int) -> Action:
        """The `clip`-th animation, sampled at its own rate.

        raises  SceneError when it moves nothing
        """
        animation = self._gltf.animations[clip]
        curves: dict[tuple[int, str], Curve] = {}
        for channel in animation.channels:
            if channel.target.node is None or channel.target.path == "weights":
                continue
            sampler = animation.samplers[channel.sampler]
            times = self._array(sampler.input).ravel().astype(float)
            values = self._array(sampler.output).astype(float)
            kind = sampler.interpolation or "LINEAR"
            curves[channel.target.node, channel.target.path] = times, values, kind
        if not curves:
            raise SceneError(f"{self._name}: clip '{self.clips[clip]}' moves no joint.")
        keys = [times for times, _, _ in curves.values()]
        times = frame_times(np.concatenate(keys), max(keys, key=len))
        world = self._worlds(times, curves)[:, self._joints]
        step = float(times[-1] - times[0]) / (len(times) - 1) or 1.0
        return Action(step, world[..., :3, 3], rotations_in(world[..., :3, :3]))

    @cached_property
    def _rest(self) -> Array:
        """(nodes, 4, 4) every node's frame to the world's as the file has it without a clip."""
        return self._worlds(np.zeros(1), {})[0]

    def _parents_first(self) -> list[int]:
        order, pending = [], [n for n, parent in enumerate(self._parents) if parent < 0]
        while pending:
            node = pending.pop(0)
            order.append(node)
            pending = [*(self._gltf.nodes[node].children or []), *pending]
        return order

    def _worlds(self, times: Array, curves: dict[tuple[int, str], Curve]) -> Array:
        """(frames, nodes, 4, 4) every node's frame to the world's, z up."""
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

    def _into_world(self, skin: gl.Skin) -> Array:
        """(4, 4) from the axes of a skin's meshes to the world's: by its first joint, at rest."""
        first = min(range(len(skin.joints)), key=lambda n: self._order.index(skin.joints[n]))
        return np.asarray(self._rest[skin.joints[first]] @ self._inverse_binds(skin)[first])

    def _inverse_binds(self, skin: gl.Skin) -> Array:
        """(joints, 4, 4) world of a skin's meshes to each joint's frame."""
        if skin.inverseBindMatrices is None:
            raise SceneError(
                f"{self._name}: skin '{skin.name}' has no inverse bind matrices. Export it with "
                "the mesh bound to the armature."
            )
        columns = self._array(skin.inverseBindMatrices).astype(float)
        return columns.reshape(-1, 4, 4).swapaxes(1, 2)

    def _weights(self, part: gl.Primitive, joints: Integers, count: int) -> Array:
        """(count, n) shares of all joints, which need not sum to one in the file."""
        shares = np.zeros((count, len(self._joints)))
        attributes, number = vars(part.attributes), 0
        while attributes.get(f"JOINTS_{number}") is not None:
            own = joints[self._array(attributes[f"JOINTS_{number}"]).astype(np.int64)]
            weights = self._array(attributes[f"WEIGHTS_{number}"]).astype(float)
            np.add.at(shares, (np.arange(count)[:, None], own), weights)
            number += 1
        total = shares.sum(axis=1)
        shares[total <= 0.0, joints[0]] = 1.0
        return np.asarray(shares / np.where(total > 0.0, total, 1.0)[:, None])

    def _array(self, number: int) -> NDArray[Any]:
        """(count, width) the elements of an accessor."""
        accessor = self._gltf.accessors[number]
        kind, width = np.dtype(KINDS[accessor.componentType]), WIDTHS[accessor.type]
        if accessor.bufferView is None:
            values = np.zeros((accessor.count, width), kind)
        else:
            first = accessor.byteOffset or 0
            values = self._view(accessor.bufferView, first, kind, accessor.count, width)
        if accessor.sparse is not None:
            where, new = accessor.sparse.indices, accessor.sparse.values
            chosen, count = np.dtype(KINDS[where.componentType]), accessor.sparse.count
            rows = self._view(where.bufferView, where.byteOffset or 0, chosen, count, 1)
            values = values.copy()
            values[rows.ravel()] = self._view(
                new.bufferView, new.byteOffset or 0, kind, count, width
            )
        if accessor.normalized and kind.kind in "iu":
            largest = 2.0 ** (8 * kind.itemsize - (kind.kind == "i")) - 1.0
            return np.maximum(values.astype(float) / largest, -1.0)
        return values

    def _view(
        self, number: int, first: int, kind: np.dtype[Any], count: int, width: int
    ) -> NDArray[Any]:
        view = self._gltf.bufferViews[number]
        step = view.byteStride or width * kind.itemsize
        return np.ndarray(
            (count, width),
            kind,
            self._blob,
            (view.byteOffset or 0) + first,
            (step, kind.itemsize),
        )


def _local(node: gl.Node, number: int, times: Array, curves: dict[tuple[int, str], Curve]) -> Array:
    """(frames, 4, 4) a node's frame to its parent's."""
    still = {
        "translation": node.translation or (0.0, 0.0, 0.0),
        "rotation": node.rotation or (0.0, 0.0, 0.0, 1.0),
        "scale": node.scale or (1.0, 1.0, 1.0),
    }
    now = {
        path: _sampled(*curves[number, path], times, turns=path == "rotation")
        if (number, path) in curves
        else np.tile(np.asarray(values, float), (len(times), 1))
        for path, values in still.items()
    }
    local = np.tile(np.eye(4), (len(times), 1, 1))
    turn = Rotation.from_quat(now["rotation"]).as_matrix()
    local[:, :3, :3] = turn * now["scale"][:, None, :]
    local[:, :3, 3] = now["translation"]
    return local


def _sampled(keys: Array, values: Array, kind: str, times: Array, *, turns: bool) -> Array:
    """(frames, m) values of a curve at some times; `turns` where they are quaternions."""
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
