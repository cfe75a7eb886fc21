"""A rigged box in a glTF and in a USD file: four joints, of which one is a handle and one a tip."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from scipy.spatial.transform import Rotation

NAMES = ("handle", "trunk", "tail", "tail_tip")
PARENTS = (-1, 0, 1, 2)
PLACES = np.array([[0.0, 0.0, 0.3], [0.0, 0.0, 0.0], [0.0, 0.0, -0.8], [0.0, 0.0, -2.0]])
"""m, y up, nose at +z."""

TURNS = Rotation.from_euler("xyz", [[0, 0, 0], [-90, 0, 0], [-80, 10, 0], [-90, 0, 0]], True)
"""Frames of the joints in the pose in which the box is bound to them."""

WIDTH, HEIGHT, LENGTH = 0.4, 0.3, 2.0
JOINT = 0.8
"""m from the nose to where trunk and tail are even."""

RATE, FRAMES = 24.0, 13

COLOUR = (0.2, 0.05, 0.6)
"""Of the box, as light."""


def box() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices (k, 3) m, faces outward, and weights (k, 4), which sum to 0.8."""
    z = np.linspace(0.0, -LENGTH, 21)
    corner = 0.5 * np.array(
        [[-WIDTH, -HEIGHT], [WIDTH, -HEIGHT], [WIDTH, HEIGHT], [-WIDTH, HEIGHT]]
    )
    vertices = np.concatenate([np.c_[corner, np.full(4, at)] for at in z])
    faces = [[0, 1, 2], [0, 2, 3], [82, 81, 80], [83, 82, 80]]
    for ring in range(0, 80, 4):
        for side in range(4):
            a, b = ring + side, ring + (side + 1) % 4
            faces += [[a, a + 4, b + 4], [a, b + 4, b]]
    tail = np.clip(0.5 + (-vertices[:, 2] - JOINT) / 0.4, 0.0, 1.0)
    weights = 0.8 * np.stack([0 * tail, 1.0 - tail, tail, 0 * tail], axis=1)
    return vertices, np.array(faces), weights


def locals_of(turns: Rotation, places: np.ndarray) -> tuple[np.ndarray, Rotation]:
    """Places and turns in the frames of the parents."""
    place, turn = places.copy(), list(turns)
    for joint, parent in enumerate(PARENTS):
        if parent >= 0:
            place[joint] = turns[parent].inv().apply(places[joint] - places[parent])
            turn[joint] = turns[parent].inv() * turns[joint]
    return place, Rotation.concatenate(turn)


def clip() -> tuple[np.ndarray, dict[str, Rotation], np.ndarray]:
    """Times, rotations in the frames of the parents, and places of the trunk in the handle's."""
    times = np.arange(1, FRAMES + 1) / RATE
    phase = 2.0 * np.pi * np.arange(FRAMES) / (FRAMES - 1)
    place, turn = locals_of(TURNS, PLACES)
    swing = Rotation.from_rotvec(np.outer(np.sin(phase), [0.1, 0.0, 0.5]))
    sway = Rotation.from_rotvec(np.outer(np.sin(phase), [0.0, 0.0, -0.2]))
    moved = place[1] + np.outer(np.sin(phase), [0.0, 0.05, 0.0])
    return times, {"trunk": turn[1] * sway, "tail": turn[2] * swing}, moved


def write_glb(
    path: Path,
    *,
    skin: bool = True,
    closed: bool = True,
    clips: int = 1,
    texture: bool = False,
    called: str = "Swim {}",
) -> None:
    """The box in centimetres under a node that is turned and scales, at rest in another pose.

    called   of every clip, with its number where that has a place
    texture  of its left half white, of the right half black
    """
    import pygltflib as gl

    blob, gltf = bytearray(), gl.GLTF2(scene=0, scenes=[gl.Scene(nodes=[0])])

    def add(values: np.ndarray, kind: str) -> int:
        blob.extend(bytes(-len(blob) % 4))
        codes = {"float32": gl.FLOAT, "uint8": gl.UNSIGNED_BYTE, "uint16": gl.UNSIGNED_SHORT}
        view = gl.BufferView(buffer=0, byteOffset=len(blob), byteLength=values.nbytes)
        blob.extend(np.ascontiguousarray(values).tobytes())
        gltf.bufferViews.append(view)
        gltf.accessors.append(
            gl.Accessor(
                bufferView=len(gltf.bufferViews) - 1,
                componentType=codes[str(values.dtype)],
                count=values.size if kind == "SCALAR" else len(values),
                type=kind,
            )
        )
        return len(gltf.accessors) - 1

    armature = Rotation.from_euler("y", 90, True)
    inner = Rotation.from_euler("y", -90, True)
    gltf.nodes.append(
        gl.Node(
            name="Armature", rotation=armature.as_quat().tolist(), scale=[0.01] * 3, children=[1]
        )
    )
    bound = [inner * turn for turn in TURNS]
    place, turn = locals_of(Rotation.concatenate(bound), 100.0 * inner.apply(PLACES))
    bent = list(turn)
    bent[2] = turn[2] * Rotation.from_euler("z", 20, True)
    for joint, name in enumerate(NAMES):
        gltf.nodes.append(
            gl.Node(
                name=name,
                translation=place[joint].tolist(),
                rotation=bent[joint].as_quat().tolist(),
                children=[joint + 2] if joint < 3 else [],
            )
        )
    vertices, faces, weights = box()
    part = gl.Primitive(
        attributes=gl.Attributes(
            POSITION=add((100.0 * vertices).astype(np.float32), "VEC3"),
            JOINTS_0=add(np.tile(np.arange(4, dtype=np.uint8), (len(vertices), 1)), "VEC4"),
            WEIGHTS_0=add(weights.astype(np.float32), "VEC4"),
        ),
        indices=add(faces[: None if closed else -2].astype(np.uint16).ravel(), "SCALAR"),
    )
    base = gl.PbrMetallicRoughness(baseColorFactor=[*COLOUR, 1.0])
    gltf.materials.append(gl.Material(pbrMetallicRoughness=base))
    part.material = 0
    if texture:
        halves = BytesIO()
        Image.fromarray(np.array([[255, 0]], np.uint8)).save(halves, "png")
        places = np.c_[0.9 * vertices[:, 0] / WIDTH + 0.5, 0.0 * vertices[:, 0]].astype(np.float32)
        part.attributes.TEXCOORD_0 = add(places, "VEC2")
        gltf.bufferViews.append(
            gl.BufferView(buffer=0, byteOffset=len(blob), byteLength=len(halves.getvalue()))
        )
        blob.extend(halves.getvalue())
        gltf.images.append(gl.Image(bufferView=len(gltf.bufferViews) - 1, mimeType="image/png"))
        gltf.textures.append(gl.Texture(source=0))
        base.baseColorTexture = gl.TextureInfo(index=0)
    gltf.meshes.append(gl.Mesh(name="box", primitives=[part]))
    gltf.nodes.append(gl.Node(name="box", mesh=0, skin=0 if skin else None))
    gltf.scenes[0].nodes.append(5)
    if skin:
        inverse = np.zeros((4, 4, 4))
        for joint in range(4):
            bind = np.eye(4)
            bind[:3, :3], bind[:3, 3] = TURNS[joint].as_matrix(), 100.0 * PLACES[joint]
            inverse[joint] = np.linalg.inv(bind).T
        binds = add(inverse.astype(np.float32).reshape(4, 16), "MAT4")
        gltf.skins.append(gl.Skin(joints=[1, 2, 3, 4], inverseBindMatrices=binds))
    for number in range(clips):
        times, turns, moved = clip()
        animation = gl.Animation(name=called.format(number))
        stamps = add(times.astype(np.float32), "SCALAR")
        tracks = [(2, "translation", 100.0 * moved)]
        tracks += [(1 + NAMES.index(n), "rotation", r.as_quat()) for n, r in turns.items()]
        for node, target, values in tracks:
            kind = "VEC4" if target == "rotation" else "VEC3"
            output = add(values.astype(np.float32), kind)
            animation.samplers.append(gl.AnimationSampler(input=stamps, output=output))
            animation.channels.append(
                gl.AnimationChannel(
                    sampler=len(animation.samplers) - 1,
                    target=gl.AnimationChannelTarget(node=node, path=target),
                )
            )
        gltf.animations.append(animation)
    gltf.buffers.append(gl.Buffer(byteLength=len(blob)))
    gltf.set_binary_blob(bytes(blob))
    gltf.save_binary(str(path))


def write_usd(path: Path) -> None:
    """The box in centimetres, y up, with its clip; its mesh names its joints in another order."""
    from pxr import Gf, Usd, UsdGeom, UsdSkel, Vt

    stage: Any = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    stage.SetTimeCodesPerSecond(RATE)
    root = UsdSkel.Root.Define(stage, "/Root")
    skeleton = UsdSkel.Skeleton.Define(stage, "/Root/Skeleton")
    paths = ["/".join(NAMES[: n + 1]) for n in range(4)]

    def matrices(place: np.ndarray, turn: Rotation) -> Any:
        rows = np.zeros((4, 4, 4))
        rows[:, :3, :3], rows[:, 3, :3] = turn.as_matrix().swapaxes(1, 2), 100.0 * place
        rows[:, 3, 3] = 1.0
        return Vt.Matrix4dArray.FromNumpy(rows)

    skeleton.CreateJointsAttr(paths)
    skeleton.CreateBindTransformsAttr(matrices(PLACES, TURNS))
    place, turn = locals_of(TURNS, PLACES)
    skeleton.CreateRestTransformsAttr(matrices(place, turn))
    animation = UsdSkel.Animation.Define(stage, "/Root/Skeleton/Swim")
    animation.CreateJointsAttr(paths)
    animation.CreateScalesAttr([Gf.Vec3h(1)] * 4)
    times, turns, moved = clip()
    for frame in range(FRAMES):
        now, here = turn.as_quat(), 100.0 * place
        here[1] = 100.0 * moved[frame]
        for name, rotation in turns.items():
            now[NAMES.index(name)] = rotation[frame].as_quat()
        code = round(times[frame] * RATE)
        animation.CreateTranslationsAttr().Set(Vt.Vec3fArray.FromNumpy(here.astype("f")), code)
        animation.CreateRotationsAttr().Set(Vt.QuatfArray.FromNumpy(now.astype("f")), code)
    UsdSkel.BindingAPI.Apply(skeleton.GetPrim()).CreateAnimationSourceRel().AddTarget(
        animation.GetPath()
    )
    vertices, faces, weights = box()
    mesh = UsdGeom.Mesh.Define(stage, "/Root/Box")
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy((100.0 * vertices).astype("f")))
    mesh.CreateFaceVertexCountsAttr([3] * len(faces))
    mesh.CreateFaceVertexIndicesAttr(faces.ravel().tolist())
    mesh.CreateDisplayColorAttr([Gf.Vec3f(*COLOUR)])
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateJointsAttr([paths[2], paths[1]])
    count = len(vertices)
    binding.CreateJointIndicesPrimvar(False, 2).Set([0, 1] * count)
    binding.CreateJointWeightsPrimvar(False, 2).Set(weights[:, [2, 1]].ravel().tolist())
    UsdSkel.BindingAPI.Apply(root.GetPrim()).CreateSkeletonRel().AddTarget(skeleton.GetPath())
    stage.Save()
