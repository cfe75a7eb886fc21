"""A hand whose joints lie side by side, as those of WebXR's models do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyvista
from scipy.spatial.transform import Rotation

FINGERS = ("pinky", "ring", "middle", "index", "thumb")
PARTS = ("tip", "distal", "intermediate", "proximal", "metacarpal")
CURLED = ("intermediate", "proximal")
RATE, FRAMES = 24.0, 13
CURL = 20.0
"""degrees that each of these joints turns by."""


def joints() -> tuple[list[str], np.ndarray]:
    """Names, a fingertip first, and places (25, 3) m; fingers along +z, the palm faces down."""
    along = {"tip": 1.0, "distal": 0.8, "intermediate": 0.5, "proximal": 0.0}
    names, places = [], []
    for n, finger in enumerate(FINGERS):
        across, length = 0.021 * (n - 2), 0.09 if finger in ("pinky", "thumb") else 0.11
        for part in PARTS:
            if (finger, part) == ("thumb", "intermediate"):
                continue
            names.append(f"{finger}-{part}")
            if part == "metacarpal":
                places.append((0.6 * across, 0.0, 0.005))
            else:
                places.append((across, 0.0, 0.04 + length * along[part]))
    return [*names, "wrist"], np.array([*places, (0.0, 0.0, -0.04)])


def surface() -> tuple[np.ndarray, np.ndarray]:
    """Vertices (k, 3) m and faces (m, 3) of a palm with five fingers, without holes."""
    low, high, h = np.array([-0.075, -0.03, -0.07]), np.array([0.075, 0.03, 0.175]), 0.004
    counts = np.ceil((high - low) / h).astype(int)
    grid = pyvista.ImageData(dimensions=counts, spacing=(h, h, h), origin=low)
    points = np.asarray(grid.points)
    palm = np.abs(points - [0.0, 0.0, -0.005]) - [0.045, 0.006, 0.04]
    outside, within = np.linalg.norm(np.maximum(palm, 0.0), axis=1), palm.max(axis=1)
    depth = outside + np.minimum(within, 0.0) - 0.006
    names, places = joints()
    for finger in FINGERS:
        own = places[[n for n, name in enumerate(names) if name.startswith(finger)]]
        tip, base = own[0], own[-1]
        along = np.clip((points - base) @ (tip - base) / ((tip - base) @ (tip - base)), 0.0, 1.0)
        depth = np.minimum(
            depth, np.linalg.norm(points - base - along[:, None] * (tip - base), axis=1) - 0.009
        )
    skin = grid.contour([0.0], scalars=depth).triangulate().clean()
    faces = np.asarray(skin.faces).reshape(-1, 4)[:, 1:]
    vertices = np.asarray(skin.points, float)
    corners = vertices[faces]
    volume = np.einsum("ni,ni", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
    return vertices, faces if volume > 0.0 else faces[:, ::-1]


def weights(vertices: np.ndarray) -> np.ndarray:
    """(k, 25) share of each joint, by its distance."""
    _, places = joints()
    away = np.linalg.norm(vertices[:, None] - places, axis=2)
    shares = np.exp(-0.5 * (away / 0.008) ** 2) + 1e-12
    return np.asarray(shares / shares.sum(axis=1, keepdims=True))


def write_hand(path: Path) -> None:
    """The hand as .glb, its fingers curling in a clip "curl"."""
    import pygltflib as gl

    blob, gltf = bytearray(), gl.GLTF2(scene=0, scenes=[gl.Scene(nodes=[0, 1])])

    def add(values: np.ndarray, kind: str) -> int:
        blob.extend(bytes(-len(blob) % 4))
        codes = {"float32": gl.FLOAT, "uint16": gl.UNSIGNED_SHORT, "uint32": gl.UNSIGNED_INT}
        view = gl.BufferView(buffer=0, byteOffset=len(blob), byteLength=values.nbytes)
        blob.extend(np.ascontiguousarray(values).tobytes())
        gltf.bufferViews.append(view)
        count = values.size if kind == "SCALAR" else len(values)
        gltf.accessors.append(
            gl.Accessor(
                bufferView=len(gltf.bufferViews) - 1,
                componentType=codes[str(values.dtype)],
                count=count,
                type=kind,
            )
        )
        return len(gltf.accessors) - 1

    names, places = joints()
    vertices, faces = surface()
    shares = weights(vertices)
    first = np.argsort(-shares, axis=1)[:, :4]
    share = np.take_along_axis(shares, first, axis=1)
    numbers = list(range(2, 2 + len(names)))
    gltf.nodes = [gl.Node(name="Armature", children=numbers), gl.Node(mesh=0, skin=0)]
    for name, place in zip(names, places, strict=True):
        gltf.nodes.append(gl.Node(name=name, translation=place.tolist()))
    attributes = gl.Attributes(
        POSITION=add(vertices.astype(np.float32), "VEC3"),
        JOINTS_0=add(first.astype(np.uint16), "VEC4"),
        WEIGHTS_0=add((share / share.sum(axis=1, keepdims=True)).astype(np.float32), "VEC4"),
    )
    indices = add(faces.astype(np.uint32).ravel(), "SCALAR")
    part = gl.Primitive(attributes=attributes, indices=indices)
    gltf.meshes = [gl.Mesh(primitives=[part])]
    binds = np.tile(np.eye(4), (len(names), 1, 1))
    binds[:, 3, :3] = -places
    bound = add(binds.astype(np.float32).reshape(-1, 16), "MAT4")
    gltf.skins = [gl.Skin(joints=numbers, inverseBindMatrices=bound)]
    stamps = add((np.arange(FRAMES) / RATE).astype(np.float32), "SCALAR")
    angle = np.radians(CURL) * np.sin(np.linspace(0.0, np.pi, FRAMES))
    turns = Rotation.from_rotvec(np.outer(angle, [1.0, 0.0, 0.0])).as_quat().astype(np.float32)
    clip = gl.Animation(name="curl")
    for name, node in zip(names, numbers, strict=True):
        if name.endswith(CURLED):
            clip.samplers.append(gl.AnimationSampler(input=stamps, output=add(turns, "VEC4")))
            target = gl.AnimationChannelTarget(node=node, path="rotation")
            clip.channels.append(gl.AnimationChannel(sampler=len(clip.samplers) - 1, target=target))
    gltf.animations = [clip]
    gltf.buffers = [gl.Buffer(byteLength=len(blob))]
    gltf.set_binary_blob(bytes(blob))
    gltf.save_binary(str(path))
