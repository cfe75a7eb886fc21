"""Broken inputs: a sound scene, model, clip, mesh, table or run folder, changed at random."""

from __future__ import annotations

import random
import re
import tomllib
from collections.abc import Callable
from typing import Any
from xml.etree import ElementTree

import tomli_w

from fuzz_bases import Files, bases

SECRET = b"xyzzy-plugh-2718"
"""Stands in files that are not what they should be; no message may repeat it."""

NASTY: tuple[Any, ...] = (
    *(0, 1, -1, 2, 3, 7, 1e-300, 1e300, -1e300, 0.5, -0.5, 100.0, 10**6, -(10**9), 10**18),
    *(
        float("nan"),
        float("inf"),
        float("-inf"),
        True,
        False,
        "",
        "x",
        "hinge",
        "nan",
        "summary.json",
    ),
    *("history.csv", "../../../etc/passwd", "a" * 300, "é\u202e", "a,b", "a\nb", "\x7f", "none"),
    *([], [0.0], [1.0, 2.0], [1.0, 2.0, 3.0], [[1.0]], ["x"], {}, {"x": 1}, {"kind": "x"}, [{}]),
)
"""Values in place of others."""

TEXTS = (
    *("nan", "inf", "-1", "0", "1e300", "", "x", "1 2", "1 2 3", "1 2 3 4", "nan nan nan"),
    *("true", "-1 -1 -1", "1e-300", "999999999", "a,b", "../../../etc/passwd", "0 0 0", "\u202e"),
)
"""Texts of attributes in place of others."""

ELEMENTS = (
    '<joint name="more" axis="0 0 0"/>',
    '<freejoint name="free"/>',
    '<geom type="sphere" size="0"/>',
    '<geom type="mesh" mesh="none"/>',
    '<geom type="hfield" hfield="h"/>',
    '<include file="model.xml"/>',
    '<replicate count="100000000"><geom type="sphere" size="1"/></replicate>',
    '<body name="cart"/>',
    '<body name="more"><joint/><geom type="box" size="1e-9 1 1"/></body>',
    '<inertial pos="0 0 0" mass="-1" diaginertia="1 1 1"/>',
    '<site name="s" pos="nan 0 0"/>',
    '<composite type="grid" count="1000 1000 1000" spacing="1"/>',
    '<flexcomp type="grid" count="900 900 900" spacing="1 1 1" dim="3" name="f"/>',
    '<camera name="c" fovy="-1"/>',
    '<numeric name="n" size="1000000000"/>',
    '<size memory="900G"/>',
    '<option timestep="nan" integrator="x"/>',
    '<joint joint1="hinge" joint2="hinge" polycoef="nan 1 0 0 0"/>',
)

Make = Callable[[random.Random], tuple[str, Files]]


def scene_value(rng: random.Random) -> tuple[str, Files]:
    """A value of the scene is another one, is gone, or has company."""
    name, files = _base(rng)
    raw = tomllib.loads(files["scene.toml"].decode())
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        _change(rng, raw)
    return name, files | {"scene.toml": tomli_w.dumps(raw).encode()}


def scene_text(rng: random.Random) -> tuple[str, Files]:
    """The scene's text is cut, torn, or doubled."""
    name, files = _base(rng)
    return name, files | {"scene.toml": _torn(rng, files["scene.toml"])}


def model_value(rng: random.Random) -> tuple[str, Files]:
    """Attributes and elements of the model are others, are gone, or have company."""
    name, files = _base(rng, having=".xml")
    file = _ending(files, ".xml")
    root = ElementTree.fromstring(files[file])
    for _ in range(rng.choice((1, 1, 2))):
        places = [(parent, child) for parent in root.iter() for child in parent]
        if not places:
            break
        parent, child = rng.choice(places)
        kind = rng.randrange(5)
        if kind <= 1 and child.attrib:
            child.attrib[rng.choice(list(child.attrib))] = rng.choice(TEXTS)
        elif kind == 2:
            child.attrib[rng.choice(("pos", "mass", "density", "type", "axis", "euler"))] = (
                rng.choice(TEXTS)
            )
        elif kind == 3:
            parent.remove(child)
        else:
            child.append(ElementTree.fromstring(rng.choice(ELEMENTS)))
    return name, files | {file: ElementTree.tostring(root)}


def model_text(rng: random.Random) -> tuple[str, Files]:
    """The model's text is cut, torn, or doubled."""
    name, files = _base(rng, having=".xml")
    file = _ending(files, ".xml")
    return name, files | {file: _torn(rng, files[file])}


def clip_text(rng: random.Random) -> tuple[str, Files]:
    """Words of the clip are others, or its text is torn."""
    files = bases()["walk"]
    text = files["walk.bvh"]
    return "walk", files | {
        "walk.bvh": _words(rng, text) if rng.random() < 0.7 else _torn(rng, text)
    }


def table_text(rng: random.Random) -> tuple[str, Files]:
    """Words of the table of keyframes are others, or its text is torn."""
    files = bases()["keyframes"]
    text = files["keys.csv"]
    changed = _words(rng, text) if rng.random() < 0.5 else _torn(rng, text)
    return "keyframes", files | {"keys.csv": changed}


def mesh_bytes(rng: random.Random) -> tuple[str, Files]:
    """Bytes of a mesh are others."""
    name = rng.choice(("hull-obj", "hull-stl"))
    files = bases()[name]
    file = f"hull.{name[-3:]}"
    text = files[file]
    changed = _words(rng, text) if name == "hull-obj" and rng.random() < 0.5 else _torn(rng, text)
    return name, files | {file: changed}


def surface_bytes(rng: random.Random) -> tuple[str, Files]:
    """Bytes of the surface in which flesh grows are others."""
    files = bases()["skinned"]
    return "skinned", files | {"skin.ply": _torn(rng, files["skin.ply"])}


def flesh_bytes(rng: random.Random) -> tuple[str, Files]:
    """Bytes of the mesh of flesh are others."""
    files = bases()["fish"]
    text = files["fish.vtu"]
    return "fish", files | {
        "fish.vtu": _words(rng, text) if rng.random() < 0.5 else _torn(rng, text)
    }


def stranger(rng: random.Random) -> tuple[str, Files]:
    """A file is one of another kind, whose content is nobody's business."""
    name, files = _base(rng)
    file = rng.choice(list(files))
    secret = rng.choice(
        (b"", b"root:x:0:0:", b"\x89PNG\r\n", b"PK\x03\x04", b"ply\n", b"<", b"solid ")
    )
    return name, files | {file: secret + SECRET + b" " + SECRET + b"\n" + SECRET}


MAKERS: dict[str, tuple[Make, int]] = {
    "scene's values": (scene_value, 40),
    "scene's text": (scene_text, 12),
    "model's values": (model_value, 16),
    "model's text": (model_text, 6),
    "clip": (clip_text, 10),
    "table": (table_text, 5),
    "mesh": (mesh_bytes, 5),
    "surface of flesh": (surface_bytes, 2),
    "mesh of flesh": (flesh_bytes, 2),
    "another kind of file": (stranger, 2),
}
"""What is broken -> how, and how often in a hundred."""


def make(seed: str) -> tuple[str, str, Files]:
    """What is broken, the base it was made of, and its files; the same for the same seed."""
    rng = random.Random(seed)
    kinds = list(MAKERS)
    kind = rng.choices(kinds, [MAKERS[k][1] for k in kinds])[0]
    base, files = MAKERS[kind][0](rng)
    return kind, base, files


def torn(rng: random.Random, content: bytes) -> bytes:
    """The content with bytes lost, changed, doubled or zeroed."""
    return _torn(rng, content)


def _base(rng: random.Random, having: str = "") -> tuple[str, Files]:
    """A base, the quick ones more often."""
    often = {"pendulum": 6, "slab": 6, "walk": 3, "keyframes": 2, "fish": 1}
    names = [n for n, files in bases().items() if n in often and _has(files, having)]
    name = rng.choices(names, [often[n] for n in names])[0]
    return name, dict(bases()[name])


def _has(files: Files, ending: str) -> bool:
    return any(name.endswith(ending) for name in files)


def _ending(files: Files, ending: str) -> str:
    return next(name for name in files if name.endswith(ending))


def _change(rng: random.Random, raw: dict[str, Any]) -> None:
    """Change one place in nested tables."""
    places: list[tuple[Any, Any]] = []
    pending: list[Any] = [raw]
    while pending:
        table = pending.pop()
        keys = list(table) if isinstance(table, dict) else list(range(len(table)))
        for key in keys:
            places.append((table, key))
            if isinstance(table[key], dict | list):
                pending.append(table[key])
    table, key = rng.choice(places)
    kind = rng.randrange(6)
    if kind == 0:
        del table[key]
    elif kind == 1 and isinstance(table, dict):
        table[rng.choice(("x", "kind", "file", "joint", "parameters"))] = rng.choice(NASTY)
    elif kind == 1:
        table.append(table[key])
    elif kind == 2 and isinstance(table[key], int | float) and not isinstance(table[key], bool):
        table[key] *= rng.choice((-1, 0, 1e3, 1e-3, 1e9, 1e-9))
    else:
        table[key] = rng.choice(NASTY)


def _words(rng: random.Random, text: bytes) -> bytes:
    """Some words or numbers of a text are others."""
    words = re.split(rb"(\s+|[,<>\"=])", text)
    for _ in range(rng.choice((1, 1, 2, 5))):
        place = rng.randrange(len(words))
        words[place] = rng.choice(
            (*TEXTS, "-5", "3.7", "1e9", "}", "{", "Xrotation", "\0")
        ).encode()
    return b"".join(words)


def _torn(rng: random.Random, content: bytes) -> bytes:
    if not content:
        return content
    start = rng.randrange(len(content))
    stop = min(len(content), start + rng.choice((1, 2, 8, 64, 10**9)))
    kind = rng.randrange(6)
    if kind == 0:
        return content[:start]
    if kind == 1:
        return content[:start] + content[stop:]
    if kind == 2:
        return content[:stop] + content[start:]
    if kind == 3:
        return content[:start] + b"\0" * (stop - start) + content[stop:]
    if kind == 4:
        return content[:start] + rng.randbytes(min(stop - start, 64)) + content[stop:]
    lines = content.splitlines(keepends=True)
    one, other = rng.randrange(len(lines)), rng.randrange(len(lines))
    lines[one], lines[other] = lines[other], lines[one]
    return b"".join(lines)
