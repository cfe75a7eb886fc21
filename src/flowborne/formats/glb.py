"""A run as binary glTF, by pygltflib: lengths in m; the root node rotates z up to y up."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flowborne.base.atomic import replaced_whole
from flowborne.base.colours import to_linear
from flowborne.base.extras import optional
from flowborne.base.version import __version__
from flowborne.formats.creature import Creature, ModelSkin, Surface, quaternions
from flowborne.formats.morphs import morphed, strongest
from flowborne.kernels.arrays import Array, Integers
from flowborne.motion.quaternions import continuous
from flowborne.runs.exporters import Written, provided
from flowborne.runs.open_run import StoredRun

with suppress(ImportError):  # the list of exporters imports this module without the library too
    import pygltflib as gl

TOLERANCE = 1e-6
"""Error of flesh below which no morph target is added, in sizes of the creature."""

Y_UP = [-float(np.sqrt(0.5)), 0.0, 0.0, float(np.sqrt(0.5))]
"""Rotation from z up to y up, as a quaternion (x, y, z, w)."""

INFLUENCES = 4
"""Maximum number of bones per vertex, which every reader of glTF supports."""

TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
"""Components of an element -> glTF's name of the type."""

COMPONENTS = {"float32": 5126, "uint32": 5125, "uint16": 5123}
"""Type of a number -> glTF's code."""


@provided(".glb")
@dataclass(frozen=True)
class ExporterGlb:
    """Skinned meshes on an animated skeleton; morph targets correct the skinning error of flesh.

    targets  maximum number of morph targets per flesh
    """

    targets: int = 64

    def __post_init__(self) -> None:
        if self.targets < 0:
            raise ValueError(f"targets is {self.targets}. Give 0 or more")

    def write(self, run: StoredRun, path: Path) -> Written:
        optional("pygltflib", "pygltflib", "gltf", f"'{path.suffix}' files")
        creature = Creature(run)
        file, notes = _File(run.name, run.frames_per_second), []
        file.add_skeleton(creature)
        for surface in creature.seen:
            file.add_mesh(surface, None if surface.bone < 0 else _on_bone(surface))
        for bound in creature.bound:
            file.add_mesh(bound, strongest(bound.weights, INFLUENCES))
        for skin in creature.skins:
            shape = morphed(creature, skin, INFLUENCES, self.targets, TOLERANCE * creature.size)
            node, mesh = file.add_mesh(skin, (shape.bones, shape.shares))
            mesh.extras = {"error_m": shape.error, "error_by_skinning_alone_m": shape.unmorphed}
            if len(shape.targets):
                file.add_targets(node, mesh, shape.targets, shape.weights)
            notes.append(
                f"flesh '{skin.name}': {len(shape.targets)} morph targets, at most "
                f"{shape.error:.2g} m from the run; {shape.unmorphed:.2g} m by skinning alone"
            )
        with replaced_whole(path) as new:
            file.save(new)
        return Written((path,), "; ".join(notes))


def _on_bone(surface: Surface) -> tuple[Integers, Array]:
    """The bone (k, 1) that carries each vertex of a geometry, and its weight (k, 1)."""
    count = len(surface.vertices)
    return np.full((count, 1), surface.bone), np.ones((count, 1))


class _File:
    """A glTF file under construction: its JSON part, its binary part, and one animation."""

    def __init__(self, name: str, frames_per_second: float) -> None:
        about = {"scene": name, "frames_per_second": frames_per_second}
        asset = gl.Asset(version="2.0", generator=f"flowborne {__version__}", extras=about)
        self._gltf = gl.GLTF2(asset=asset, scene=0, scenes=[gl.Scene(name=name, nodes=[0])])
        self._gltf.nodes.append(gl.Node(name=name, rotation=Y_UP, children=[]))
        self._animation = gl.Animation(name=name)
        self._bytes = bytearray()
        self._times, self._rate = -1, frames_per_second

    def add_skeleton(self, creature: Creature) -> None:
        """Add the bones with their motion, and the skin of all meshes."""
        skeleton = creature.skeleton
        frames = np.array(creature.run.frames, np.float32)
        self._times = self._numbers(frames / np.float32(self._rate), bounds=True)
        first = len(self._gltf.nodes)
        rest_position, rest_rotation = skeleton.rest_local()
        rest_quaternion = quaternions(rest_rotation)
        for bone, name in enumerate(skeleton.names):
            self._gltf.nodes.append(
                gl.Node(
                    name=name,
                    translation=rest_position[bone].tolist(),
                    rotation=rest_quaternion[bone].tolist(),
                    children=[],
                )
            )
            parent = int(skeleton.parents[bone])
            parent_node = self._gltf.nodes[0 if parent < 0 else first + parent]
            parent_node.children.append(first + bone)
        position, rotation = skeleton.local()
        turns = continuous(quaternions(rotation))
        for bone in range(len(skeleton.names)):
            self._animate(first + bone, "translation", position[:, bone])
            self._animate(first + bone, "rotation", turns[:, bone])
        inverse = np.zeros((len(skeleton.names), 4, 4))  # column-major
        position, rotation = skeleton.rest
        inverse[:, :3, :3] = rotation
        inverse[:, 3, :3] = -np.einsum("nji,nj->ni", rotation, position)
        inverse[:, 3, 3] = 1.0
        bound = self._numbers(inverse.reshape(-1, 16).astype(np.float32))
        nodes = list(range(first, first + len(skeleton.names)))
        self._gltf.skins.append(
            gl.Skin(name="skeleton", joints=nodes, skeleton=first, inverseBindMatrices=bound)
        )

    def add_mesh(
        self, shown: Surface | ModelSkin, bones: tuple[Integers, Array] | None
    ) -> tuple[int, gl.Mesh]:
        """Add a node with a mesh of triangles; returns its number and the mesh.

        bones  (k, m <= 4) that carry each vertex, and their weights (k, m); None for a fixed mesh
        """
        gltf, name, rgba = self._gltf, shown.name, shown.rgba
        attributes = gl.Attributes(POSITION=self._points(shown.vertices))
        if bones is not None:
            self._bind(attributes, *bones)
        colour = gl.PbrMetallicRoughness(
            baseColorFactor=[*to_linear(rgba[:3]).tolist(), float(rgba[3])],
            metallicFactor=0.0,
            roughnessFactor=0.8,
        )
        blend = "BLEND" if rgba[3] < 1.0 else "OPAQUE"
        gltf.materials.append(
            gl.Material(name=name, pbrMetallicRoughness=colour, alphaMode=blend, alphaCutoff=None)
        )
        corners = self._numbers(
            shown.faces.astype(np.uint32).reshape(-1), target=gl.ELEMENT_ARRAY_BUFFER
        )
        material = len(gltf.materials) - 1
        part = gl.Primitive(attributes=attributes, indices=corners, material=material)
        mesh = gl.Mesh(name=name, primitives=[part])
        gltf.meshes.append(mesh)
        skin = None if bones is None else 0
        gltf.nodes.append(gl.Node(name=name, mesh=len(gltf.meshes) - 1, skin=skin))
        node = len(gltf.nodes) - 1
        # skinned meshes ignore transforms of their parents, so they are not under the root
        if bones is None:
            gltf.nodes[0].children.append(node)
        else:
            gltf.scenes[0].nodes.append(node)
        return node, mesh

    def add_targets(self, node: int, mesh: gl.Mesh, targets: Array, weights: Array) -> None:
        """Add morph targets (t, k, 3) to a mesh, with their weights (frames, t)."""
        mesh.primitives[0].targets = [{"POSITION": self._points(target)} for target in targets]
        mesh.weights = [0.0] * len(targets)
        self._animate(node, "weights", weights.reshape(-1, 1))

    def save(self, path: Path) -> None:
        """Write the file."""
        gltf = self._gltf
        gltf.animations.append(self._animation)
        gltf.buffers.append(gl.Buffer(byteLength=len(self._bytes)))
        gltf.set_binary_blob(bytes(self._bytes))
        gltf.save_binary(str(path))

    def _bind(self, attributes: gl.Attributes, bones: Integers, shares: Array) -> None:
        """Bind the vertices to bones (k, m <= 4) with weights `shares` (k, m)."""
        joints, weights = np.zeros((len(bones), 4)), np.zeros((len(bones), 4))
        joints[:, : bones.shape[1]], weights[:, : bones.shape[1]] = bones, shares
        joints[weights == 0.0] = 0.0
        attributes.JOINTS_0 = self._numbers(joints.astype(np.uint16), target=gl.ARRAY_BUFFER)
        attributes.WEIGHTS_0 = self._numbers(weights.astype(np.float32), target=gl.ARRAY_BUFFER)

    def _animate(self, node: int, path: str, values: Array) -> None:
        """Animate a property of a node by its values in every frame; rotations are (x, y, z, w)."""
        output = self._numbers(values.astype(np.float32))
        self._animation.samplers.append(
            gl.AnimationSampler(input=self._times, output=output, interpolation="LINEAR")
        )
        target = gl.AnimationChannelTarget(node=node, path=path)
        self._animation.channels.append(
            gl.AnimationChannel(sampler=len(self._animation.samplers) - 1, target=target)
        )

    def _points(self, points: Array) -> int:
        """Accessor of positions (k, 3) with their bounds."""
        return self._numbers(points.astype(np.float32), target=gl.ARRAY_BUFFER, bounds=True)

    def _numbers(
        self, values: NDArray[Any], *, target: int | None = None, bounds: bool = False
    ) -> int:
        """Accessor of an array (k,) or (k, m), one element per row."""
        rows = np.ascontiguousarray(values.reshape(len(values), -1))
        self._bytes += bytes(-len(self._bytes) % 4)
        view = gl.BufferView(
            buffer=0, byteOffset=len(self._bytes), byteLength=rows.nbytes, target=target
        )
        self._bytes += rows.tobytes()
        self._gltf.bufferViews.append(view)
        accessor = gl.Accessor(
            bufferView=len(self._gltf.bufferViews) - 1,
            componentType=COMPONENTS[str(rows.dtype)],
            count=len(rows),
            type=TYPES[rows.shape[1]],
        )
        if bounds:
            accessor.min = rows.min(axis=0).tolist()
            accessor.max = rows.max(axis=0).tolist()
        self._gltf.accessors.append(accessor)
        return len(self._gltf.accessors) - 1
