"""Cables of MuJoCo 3, written as chains of bodies that MuJoCo 4 reads.

MuJoCo 3 makes a <composite type="cable"> into bodies with ball joints, and a plugin bends them as
an elastic rod. MuJoCo 4 has neither. Here each edge of the cable is a body of the same name, and
its ball joint is as stiff as the rod: bend I / L, N m a radian, for the second moment of area I of
the section and the length L of the edge before.
"""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np
from scipy.spatial.transform import Rotation

from flowborne.kernels.arrays import Array
from flowborne.solids.model_files import text_of

PLUGIN = "mujoco.elasticity.cable"

ROUND, BOX = ("capsule", "cylinder"), "box"
"""Sections that a cable may have."""

COLLINEAR = 1e-9
"""Sine of the angle between two directions below which they are the same."""


def write_chains(path: Path) -> tuple[Path, tuple[str, ...]]:
    """A copy of an MJCF file beside it, with its cables as chains.

    returns  the copy, and notes
    raises   ValueError for a file without cables, with other composites or wrong numbers, or whose
             copy exists; OSError; ElementTree.ParseError
    """
    made = path.with_name(f"{path.stem}-chains.xml")
    if made.exists():
        raise ValueError(f"{made} is there already. Remove it first.")
    parser = ElementTree.XMLParser(target=ElementTree.TreeBuilder(insert_comments=True))
    root = ElementTree.fromstring(text_of(path), parser)
    notes = []
    for parent in list(root.iter()):
        for number, element in enumerate(list(parent)):
            if element.tag == "composite":
                try:
                    parent[number] = _chain(element, root)
                except (ValueError, KeyError, IndexError) as error:
                    name = element.get("prefix", "")
                    raise ValueError(f"{path}: composite '{name}': {error}") from error
                notes += _notes(element, root)
    if not notes:
        raise ValueError(f"{path} has no <composite>. Give the file that has one.")
    for extension in root.findall("extension"):
        for plugin in extension.findall(f"plugin[@plugin='{PLUGIN}']"):
            extension.remove(plugin)
        if not len(extension):
            root.remove(extension)
    ElementTree.indent(root)
    made.write_bytes(ElementTree.tostring(root, encoding="utf-8") + b"\n")
    return made, tuple(notes)


def _chain(cable: Element, root: Element) -> Element:
    """The first body of a chain, with the others in it."""
    if cable.get("type") != "cable":
        raise ValueError(
            f"it is of type '{cable.get('type')}', and only cables are chains of bodies. Describe "
            "soft parts by [[flesh]] of the scene."
        )
    prefix, points = cable.get("prefix", ""), _points(cable)
    edges = np.diff(points, axis=0)
    length = np.linalg.norm(edges, axis=1)
    if not (length > 0.0).all():
        raise ValueError("two of its points are the same. Give it a size.")
    frames = _frames(edges / length[:, None])
    stiffness = _config(cable, root, "bend") * _second_moment(cable) / length
    names = ["first", *(str(n) for n in range(1, len(edges) - 1)), "last"][: len(edges)]
    first = body = Element("body")
    for n, (name, frame) in enumerate(zip(names, frames, strict=True)):
        place, turn = points[0], frame
        if n:
            place, turn = np.array([length[n - 1], 0.0, 0.0]), frames[n - 1].inv() * frame
            body = ElementTree.SubElement(body, "body")
        quat = turn.as_quat(scalar_first=True)
        body.attrib |= {"name": f"{prefix}B_{name}", "pos": _text(place), "quat": _text(quat)}
        kind = cable.get("initial", "ball") if n == 0 else "ball"
        if kind == "free":
            ElementTree.SubElement(body, "freejoint", name=f"{prefix}J_{name}")
        elif kind != "none":
            given = {"name": f"{prefix}J_{name}"} | _joint(cable)
            spring = float(given.get("stiffness", 0.0)) + (stiffness[n - 1] if n else 0.0)
            given |= {"type": "ball", "stiffness": f"{spring:.9g}"}
            ElementTree.SubElement(body, "joint", given)
        ElementTree.SubElement(body, "geom", _geom(cable, float(length[n]), f"{prefix}G{n}"))
        for end, at in (("first", 0.0), ("last", float(length[n]))):
            if name == end:
                site = {k: v for part in cable.findall("site") for k, v in part.items()}
                site |= {"name": f"{prefix}S_{end}", "pos": _text(np.array([at, 0.0, 0.0]))}
                ElementTree.SubElement(body, "site", site)
    return first


def _points(cable: Element) -> Array:
    """(n, 3) m of the corners of a cable in the frame of its parent body."""
    offset = np.array(_values(cable, "offset", "0 0 0"))
    if "vertex" in cable.attrib:
        points = np.array(_values(cable, "vertex", "")).reshape(-1, 3)
    else:
        count = int(_values(cable, "count", "1")[0])
        size = [*_values(cable, "size", "1 0 0"), 0.0, 0.0][:3]
        s = np.linspace(0.0, 1.0, count)
        curves = {
            "s": size[0] * s,
            "cos(s)": size[1] * np.cos(math.pi * size[2] * s),
            "sin(s)": size[1] * np.sin(math.pi * size[2] * s),
            "0": 0.0 * s,
        }
        names = [*cable.get("curve", "0 0 0").split(), "0", "0"][:3]
        points = np.stack([curves[name] for name in names], axis=1)
    if len(points) < 3:
        raise ValueError(f"it has {len(points)} points. Give a cable at least 3.")
    turn = Rotation.from_quat(_values(cable, "quat", "1 0 0 0"), scalar_first=True)
    return np.asarray(offset + turn.apply(points))


def _frames(tangents: Array) -> list[Rotation]:
    """For each edge a frame with x along it, which does not turn about it from edge to edge."""
    across = np.cross(tangents[0], [0.0, 1.0, 0.0])
    if np.linalg.norm(across) < COLLINEAR:
        across = np.cross(tangents[0], [1.0, 0.0, 0.0])
    z = across / np.linalg.norm(across)
    frames = [Rotation.from_matrix(np.stack([tangents[0], np.cross(z, tangents[0]), z], axis=1))]
    for before, after in pairwise(tangents):
        axis = np.cross(before, after)
        sine = float(np.linalg.norm(axis))
        angle = math.atan2(sine, float(before @ after))
        bend = axis / sine * angle if sine > COLLINEAR else np.zeros(3)
        frames.append(Rotation.from_rotvec(bend) * frames[-1])
    return frames


def _geom_of(cable: Element) -> dict[str, str]:
    given = cable.find("geom")
    found = {} if given is None else dict(given.items())
    if found.setdefault("type", "capsule") not in (*ROUND, BOX):
        raise ValueError(f"its geom is of type '{found['type']}'. Give capsule, cylinder or box.")
    return found


def _geom(cable: Element, length: float, name: str) -> dict[str, str]:
    """Attributes of the geom of an edge."""
    geom = _geom_of(cable) | {"name": name}
    if geom["type"] in ROUND:
        return geom | {"size": geom["size"].split()[0], "fromto": f"0 0 0 {length:.9g} 0 0"}
    _, *section = geom["size"].split()
    half = f"{0.5 * length:.9g}"
    return geom | {"size": " ".join([half, *section]), "pos": f"{half} 0 0"}


def _second_moment(cable: Element) -> float:
    """Second moment of area of the section, m^4; of a box the mean of both."""
    geom = _geom_of(cable)
    sizes = [float(value) for value in geom["size"].split()]
    if geom["type"] in ROUND:
        return 0.25 * math.pi * sizes[0] ** 4
    _, wide, high = sizes
    return 2.0 / 3.0 * wide * high * (wide**2 + high**2)


def _joint(cable: Element) -> dict[str, str]:
    """Attributes of its joints in the file."""
    return {k: v for part in cable.findall("joint") for k, v in part.items() if k != "kind"}


def _config(cable: Element, root: Element, key: str) -> float:
    """A number of the plugin, given in the cable or in the instance that it names; 0 without."""
    for plugin in cable.findall("plugin"):
        name = plugin.get("instance")
        places = [plugin] if name is None else root.findall(f".//instance[@name='{name}']")
        for place in places:
            for config in place.findall(f"config[@key='{key}']"):
                return float(config.get("value", "0"))
    return 0.0


def _notes(cable: Element, root: Element) -> list[str]:
    prefix, bend, twist = (
        cable.get("prefix", ""),
        *(_config(cable, root, key) for key in ("bend", "twist")),
    )
    notes = [
        f"cable '{prefix}': {len(_points(cable)) - 1} bodies, bend = {bend:g} Pa; they overlap at "
        "their joints, and have mass and volume each for itself"
    ]
    if twist:
        notes.append(
            f"cable '{prefix}': a ball joint is as stiff against twist as against bending, so that "
            f"twist = {twist:g} Pa is not used"
        )
    if any(config.get("key") == "flat" for config in cable.iter("config")):
        notes.append(f"cable '{prefix}': flat is not used, and it rests as it is drawn")
    if cable.find("skin") is not None:
        notes.append(f"cable '{prefix}': its skin is left out")
    return notes


def _values(element: Element, key: str, default: str) -> list[float]:
    return [float(value) for value in element.get(key, default).split()]


def _text(values: Array) -> str:
    return " ".join(f"{value:.9g}" for value in values)
