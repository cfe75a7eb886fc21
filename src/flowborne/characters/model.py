"""The bodies of a character as MJCF, with its surface as skins for viewers and exporters."""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from flowborne.characters.colours import few_colours
from flowborne.characters.division import Division
from flowborne.characters.rig import Array, Rig, Surface
from flowborne.shapes.shape import Mesh
from flowborne.solids.geoms import DISPLACED

INFLUENCES = 8
"""Joints that carry a vertex of the skin at most: as many as exporters write."""

Element = ElementTree.Element


def model_files(
    name: str, rig: Rig, division: Division, surface: Surface, density: float
) -> dict[str, bytes]:
    """A model whose bodies have the rig's names and frames: file -> content.

    Every joint of the rig is a body, in whose frame it rests. Those that move have a ball joint of
    the same name, the topmost a free joint; the others are rigid with the body above them.

    density  kg/m^3 of all pieces
    """
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
        if len(division.pieces[joint][1]):
            file = f"{name}-meshes/{joint}.obj"
            shape, piece = (
                ((vertices - rig.position[joint]) @ rig.rotation[joint], faces)
                for vertices, faces in (division.shapes[joint], division.pieces[joint])
            )
            files[file] = _obj(shape)
            ElementTree.SubElement(assets, "mesh", name=own, file=file)
            mass = mass_of(piece, density)
            body.append(_inertial(mass))
            data = _numbers(np.array([mass.volume, *mass.center_mass]))
            ElementTree.SubElement(custom, "numeric", name=DISPLACED + own, data=data)
            ElementTree.SubElement(body, "geom", name=own, mesh=own)
    files[f"{name}.xml"] = _text(root)
    files[f"{name}-skin.xml"] = _text(_skins(name, rig, surface))
    return files


def mass_of(mesh: Mesh, density: float) -> Any:
    """Mass, centre and inertia of a closed surface, as trimesh has them."""
    import trimesh  # a tenth of a second that only characters need

    vertices, faces = mesh
    return trimesh.triangles.mass_properties(vertices[faces], density=density)


def _inertial(mass: Any) -> Element:
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = mass.inertia
    return ElementTree.Element(
        "inertial",
        pos=_numbers(mass.center_mass),
        mass=_numbers(mass.mass),
        fullinertia=_numbers(np.array([xx, yy, zz, xy, xz, yz])),
    )


def _place(rig: Rig, joint: int) -> dict[str, str]:
    """Where a joint is in the frame of the one above it."""
    position, rotation, parent = rig.position[joint], rig.rotation[joint], int(rig.parents[joint])
    if parent >= 0:
        above = rig.rotation[parent].T
        position, rotation = above @ (position - rig.position[parent]), above @ rotation
    turn = Rotation.from_matrix(rotation).as_quat(scalar_first=True)
    return {"pos": _numbers(position), "quat": _numbers(turn)}


def _skins(name: str, rig: Rig, surface: Surface) -> Element:
    """The whole surface, carried by the bodies: a skin for each of its colours."""
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
        _carry(skin, rig, surface.weights[used])
    return root


def _carry(skin: Element, rig: Rig, weights: Array) -> None:
    """Bones of a skin, which carry its vertices with shares `weights` (k, n)."""
    least = np.sort(weights, axis=1)[:, -INFLUENCES:].min(axis=1)
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
