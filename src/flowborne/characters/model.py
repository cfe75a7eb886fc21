"""The bodies of a character as MJCF, and their motion in a clip.

The surface is a skin for viewers and exporters."""

from __future__ import annotations

from dataclasses import replace
from typing import Any
from xml.etree import ElementTree

import numpy as np
from PIL import Image
from scipy.spatial.transform import Rotation

from flowborne.characters.division import Division
from flowborne.characters.flesh import CharacterFlesh, without
from flowborne.characters.rig import Action, Rig, Surface
from flowborne.kernels.arrays import Array, Integers, Mesh
from flowborne.motion.clip import Clip
from flowborne.motion.clip_curves import MAX_CYCLE_MISMATCH
from flowborne.motion.quaternions import angle, inverse, product
from flowborne.solids.geoms import DISPLACED

MAX_INFLUENCES = 8
"""Largest number of joints per vertex of the skin, as in exporters."""

MAX_COLOURS = 8
"""Largest number of colours of a surface; each is a skin."""

Element = ElementTree.Element


def model_files(
    name: str,
    rig: Rig,
    division: Division,
    surface: Surface,
    density: float,
    flesh: CharacterFlesh | None = None,
) -> dict[str, bytes]:
    """Files of a model, name -> content, with a body for each joint of the rig.

    A body has the name and frame of its joint. Bodies of moving joints have a ball joint of the
    same name, the root a free joint; the others are rigid with their parent body. Bodies of flesh
    have their cores only; the surface of the flesh is a file, and no part of the skin.

    density  kg/m^3 of all pieces
    """
    import trimesh  # takes a tenth of a second

    files = {}
    root = ElementTree.Element("mujoco", model=name)
    default = ElementTree.SubElement(root, "default")
    values = {"type": "mesh", "contype": "0", "conaffinity": "0", "density": f"{density:g}"}
    ElementTree.SubElement(default, "geom", values)
    assets = ElementTree.SubElement(root, "asset")
    custom = ElementTree.SubElement(root, "custom")
    ElementTree.SubElement(root, "include", file=f"{name}-skin.xml")
    bodies: dict[int, Element] = {-1: ElementTree.SubElement(root, "worldbody")}
    for joint, parent in enumerate(rig.parents.tolist()):
        own = rig.names[joint]
        body = ElementTree.SubElement(bodies[parent], "body", {"name": own} | _place(rig, joint))
        bodies[joint] = body
        if joint not in division.pieces:
            continue
        if parent < 0:
            ElementTree.SubElement(body, "freejoint", name=own)
        else:
            ElementTree.SubElement(body, "joint", name=own, type="ball")
        if flesh is not None and joint in flesh.cores:
            ends, radius = flesh.cores[joint]
            ends = (ends - rig.position[joint]) @ rig.rotation[joint]
            core = {"type": "capsule", "fromto": _numbers(ends)}
            if np.ptp(ends, axis=0).max() < 1e-3 * radius:
                core = {"type": "sphere", "pos": _numbers(ends[0])}
            ElementTree.SubElement(body, "geom", {"name": own, "size": f"{radius:.9g}"} | core)
        elif len(division.pieces[joint][1]):
            file = f"{name}-meshes/{joint}.obj"
            shape, piece = (
                ((vertices - rig.position[joint]) @ rig.rotation[joint], faces)
                for vertices, faces in (division.shapes[joint], division.pieces[joint])
            )
            files[file] = _obj(shape)
            ElementTree.SubElement(assets, "mesh", name=own, file=file)
            vertices, faces = piece
            mass = trimesh.triangles.mass_properties(vertices[faces], density=density)
            body.append(_inertial(mass))
            data = _numbers(np.array([mass.volume, *mass.center_mass]))
            ElementTree.SubElement(custom, "numeric", name=DISPLACED + own, data=data)
            ElementTree.SubElement(body, "geom", name=own, mesh=own)
    if flesh is not None:
        files[f"{name}-meshes/flesh.obj"] = _obj(flesh.surface)
        surface = without(surface, division, flesh)
    files[f"{name}.xml"] = _text(root)
    files[f"{name}-skin.xml"] = _text(_skins(name, rig, surface))
    return files


def _inertial(mass: Any) -> Element:
    """Mass, centre and inertia of a closed surface, computed by trimesh."""
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = mass.inertia
    return ElementTree.Element(
        "inertial",
        pos=_numbers(mass.center_mass),
        mass=_numbers(mass.mass),
        fullinertia=_numbers(np.array([xx, yy, zz, xy, xz, yz])),
    )


def _place(rig: Rig, joint: int) -> dict[str, str]:
    """Position and rotation of a joint in the frame of its parent, as attributes."""
    position, rotation, parent = rig.position[joint], rig.rotation[joint], int(rig.parents[joint])
    if parent >= 0:
        above = rig.rotation[parent].T
        position, rotation = above @ (position - rig.position[parent]), above @ rotation
    turn = Rotation.from_matrix(rotation).as_quat(scalar_first=True)
    return {"pos": _numbers(position), "quat": _numbers(turn)}


def _skins(name: str, rig: Rig, surface: Surface) -> Element:
    """The whole surface on the bodies: a skin for each of its colours."""
    root = ElementTree.Element("mujoco")
    deformable = ElementTree.SubElement(root, "deformable")
    colours, which = few_colours(surface.colours)
    for number, colour in enumerate(colours):
        used, faces = np.unique(surface.faces[which == number], return_inverse=True)
        skin = ElementTree.SubElement(
            deformable,
            "skin",
            name=name if number == 0 else f"{name}-{number + 1}",
            vertex=_numbers(surface.vertices[used]),
            face=" ".join(map(str, faces.ravel().tolist())),
            rgba=f"{_numbers(colour)} 1",
        )
        _add_bones(skin, rig, surface.weights[used])
    return root


def _add_bones(skin: Element, rig: Rig, weights: Array) -> None:
    """Add the bones to a skin whose vertices have the weights (k, n)."""
    least = np.sort(weights, axis=1)[:, -MAX_INFLUENCES:].min(axis=1)
    carried = (weights >= least[:, None]) & (weights > 0.0)
    turns = Rotation.from_matrix(rig.rotation).as_quat(scalar_first=True)
    for joint in np.flatnonzero(carried.any(axis=0)):
        vertices = np.flatnonzero(carried[:, joint])
        ElementTree.SubElement(
            skin,
            "bone",
            body=rig.names[joint],
            bindpos=_numbers(rig.position[joint]),
            bindquat=_numbers(turns[joint]),
            vertid=" ".join(map(str, vertices.tolist())),
            vertweight=_numbers(weights[vertices, joint]),
        )


def few_colours(colours: Array) -> tuple[Array, Integers]:
    """At most MAX_COLOURS colours (n, 3), and for each of (m, 3) the index (m,) of its colour."""
    bytes_of = np.rint(255.0 * np.clip(np.nan_to_num(colours), 0.0, 1.0)).astype(np.uint8)
    found, which = np.unique(bytes_of, axis=0, return_inverse=True)
    if len(found) > MAX_COLOURS:
        reduced = Image.fromarray(bytes_of[None]).quantize(
            MAX_COLOURS, Image.Quantize.MEDIANCUT, MAX_COLOURS
        )
        palette = np.array(reduced.getpalette(), np.uint8).reshape(-1, 3)
        used, which = np.unique(np.asarray(reduced)[0], return_inverse=True)
        found = palette[used]
    return found / 255.0, which.reshape(-1).astype(np.int64)


def _obj(mesh: Mesh) -> bytes:
    vertices, faces = mesh
    lines = [f"v {_numbers(vertex)}" for vertex in vertices]
    lines += [f"f {a} {b} {c}" for a, b, c in (faces + 1).tolist()]
    return ("\n".join(lines) + "\n").encode()


def _numbers(values: Array) -> str:
    return " ".join(f"{value:.9g}" for value in np.ravel(values))


def _text(root: Element) -> bytes:
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="utf-8") + b"\n"


def posed(rig: Rig, source: Rig, action: Action) -> Action:
    """A rig in the frames of a clip from any file, matched by joint names.

    Joints get the rotations of the clip; joints that the clip lacks keep their angles.
    Displacements in the parents' frames are scaled by the ratio of the bones' lengths.

    source  the skeleton of the clip's file
    """
    number = [source.names.index(name) if name in source.names else -1 for name in rig.names]
    own = rig.offsets(rig.position, rig.rotation)
    other = source.offsets(source.position, source.rotation)
    moved = source.offsets(action.position, action.rotation) - other
    moved *= _scale(own, other, number)
    position = np.empty((len(action.position), len(rig.names), 3))
    rotation = np.empty((*position.shape, 3))
    for joint, (parent, k) in enumerate(zip(rig.parents, number, strict=True)):
        offset = own[joint] + (moved[:, k] if k >= 0 else np.zeros((len(position), 3)))
        position[:, joint], default = offset, rig.rotation[joint]
        if parent >= 0:
            above = rotation[:, parent]
            position[:, joint] = position[:, parent] + np.einsum("fij,fj->fi", above, offset)
            default = above @ rig.rotation[parent].T @ default
        rotation[:, joint] = default if k < 0 else action.rotation[:, k]
    return Action(action.frame_time, position, rotation)


def clip_of(rig: Rig, division: Division, pose: Action) -> tuple[Clip, float]:
    """The motion of a character's bodies.

    returns  a clip of the moving joints, and their largest distance from the positions in the file,
             m: bodies are rigid, but bones of a file may stretch
    """
    joints = list(division.bodies)
    leaders = [division.leader, *joints[1:]]
    turn = pose.rotation[:, leaders] @ np.swapaxes(rig.rotation[leaders], 1, 2)
    world = Rotation.from_matrix(turn.reshape(-1, 3, 3)).as_quat(scalar_first=True)
    world = world.reshape(*turn.shape[:2], 4)
    above = [division.owners[rig.parents[joint]] if n else -1 for n, joint in enumerate(joints)]
    parents = np.array([joints.index(joint) if joint >= 0 else -1 for joint in above])
    local = world.copy()
    local[:, 1:] = product(inverse(world[:, parents[1:]]), world[:, 1:])
    rest = rig.position[joints]
    handle = rig.position[0] - rig.position[division.leader]
    clip = Clip(
        names=tuple(rig.names[joint] for joint in joints),
        parents=parents,
        offsets=rest - np.where(parents[:, None] < 0, rest, rest[parents]),
        ends={},
        frame_time=pose.frame_time,
        rotations=local,
        translation=pose.position[:, division.leader] + turn[:, 0] @ handle,
    )
    away = np.linalg.norm(clip.poses()[0][:, 1:] - pose.position[:, joints[1:]], axis=2)
    return clip, float(away.max(initial=0.0))


def as_cycle(clip: Clip) -> Clip | None:
    """The clip as a cycle that ends exactly as it begins; None if it is not one.

    If the last pose is within one frame's motion of the first, the first pose is appended; a
    travelling root continues for that frame.
    """
    steps = angle(product(inverse(clip.rotations[:-1]), clip.rotations[1:])).max()
    apart = angle(product(inverse(clip.rotations[0]), clip.rotations[-1])).max()
    if clip.frames < 3 or apart > steps:
        return None
    if apart < MAX_CYCLE_MISMATCH:
        return clip
    path, step = clip.translation, clip.translation[-1] - clip.translation[-2]
    gap = np.linalg.norm(path[0] - path[-1])
    travels = gap > np.linalg.norm(np.diff(path, axis=0), axis=1).max()
    last = path[-1] + step if travels else path[0]
    return replace(
        clip,
        rotations=np.concatenate([clip.rotations, clip.rotations[:1]]),
        translation=np.concatenate([path, [[last[0], last[1], path[0, 2]]]]),
    )


def _scale(own: Array, other: Array, number: list[int]) -> float:
    """Ratio of the summed lengths of the common bones to those of another file."""
    shared = [joint for joint, k in enumerate(number) if joint > 0 and k > 0]
    lengths = np.linalg.norm(own[shared], axis=1).sum()
    others = np.linalg.norm(other[[number[joint] for joint in shared]], axis=1).sum()
    return float(lengths / others) if others > 0.0 else 1.0
