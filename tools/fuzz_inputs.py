"""Broken scenes: values and text of a sound scene and of its model, clip, table and meshes."""

from __future__ import annotations

import random
import re
import tomllib
from collections.abc import Iterator
from functools import cache
from typing import Any
from xml.etree import ElementTree

import tomli_w

from flowborne.scenes.schema import Scene
from fuzz_bases import Broken, Files, bases
from fuzz_changes import (
    LONG,
    NASTY,
    OUTSIDE,
    SECRET,
    TEXTS,
    change,
    numbers,
    places,
    resize,
    resized,
    torn,
    words,
)
from scene_keys import hints_of, said, tables_in

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

SETTINGS = (
    *("abc", "", "=", "nan", "inf", "-inf", "1e400", "-1", "0", "0.0", "true", "[", "{", "'", '"'),
    *(
        "9223372036854775807",
        "9223372036854775808",
        "1" * 30,
        "1" * 5000,
        "0x10",
        "[1, 2",
        "[[[1]]]",
    ),
    *(
        "1979-05-27",
        "1e-320",
        "{ x = 1 }",
        "[[" * 2000,
        "a\nb",
        "\u202e",
        "\0",
        LONG,
        "1_000",
        "[]",
    ),
)
"""Texts after --set KEY=."""

KEYS = (
    "",
    ".",
    "a..b",
    "control.99.strength",
    "control.x",
    "name.x",
    "__class__",
    LONG,
    "x" + ".x" * 2000,
)
"""Keys after --set that no scene has."""

NAMES = (
    *(f"{OUTSIDE}/x", f"{OUTSIDE}", "../x", "../../x", "..", ".", "/", "", " ", "x/../../y", "a/b"),
    *(
        LONG,
        "é" * 200,
        "a\0b",
        "a\nb",
        "~/x",
        "~",
        "con",
        "-x",
        "--help",
        "\u202e",
        ".hidden",
        "a\\..\\b",
    ),
)
"""Names of scenes."""

VTK = (
    *(
        "Float64",
        "Float32",
        "Int64",
        "Int32",
        "Int8",
        "UInt8",
        "UInt64",
        "String",
        "Bit",
        "x",
        "",
        "0",
    ),
    *(
        "1",
        "-1",
        "3",
        "9",
        "1000000000000",
        "ascii",
        "binary",
        "appended",
        "raw",
        "base64",
        "UInt32",
    ),
    *(
        "BigEndian",
        "vtkLZ4DataCompressor",
        "holder",
        "bones",
        "connectivity",
        "offsets",
        "types",
        "recipe",
    ),
)
"""Texts of attributes of a .vtu file."""


def scene_value(rng: random.Random) -> Broken:
    """Values of the scene are others, are gone, or have company."""
    files = _base(rng)
    raw = tomllib.loads(files["scene.toml"].decode())
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        change(rng, raw)
    return _scene(files, raw)


def scene_size(rng: random.Random) -> Broken:
    """Numbers of the scene, and of keys that it lacks, are tiny or huge."""
    files = _base(rng)
    raw = tomllib.loads(files["scene.toml"].decode())
    for _ in range(rng.choice((1, 1, 2))):
        if rng.random() < 0.5:
            resize(rng, raw)
        else:
            path, kind = rng.choice(_numeric_keys())
            _put(rng, raw, path, _number(rng, kind))
    return _scene(files, raw)


def scene_text(rng: random.Random) -> Broken:
    """The scene's text is cut, torn, or doubled."""
    files = _base(rng)
    return Broken(files | {"scene.toml": torn(rng, files["scene.toml"])})


def scene_name(rng: random.Random) -> Broken:
    """The scene has a name that leads elsewhere, or that no file can have."""
    files = _base(rng)
    raw = tomllib.loads(files["scene.toml"].decode())
    if rng.random() < 0.7:
        raw["name"] = rng.choice(NAMES)
    else:
        found = [(t, k) for t, k in places(raw) if isinstance(t[k], str)]
        table, key = rng.choice(found)
        table[key] = rng.choice(NAMES)
    return _scene(files, raw)


def setting(rng: random.Random) -> Broken:
    """Values given by --set are no values, too large, or of keys that are none."""
    files = _base(rng)
    raw = tomllib.loads(files["scene.toml"].decode())
    own = [".".join(map(str, path)) for path in _paths(raw)]
    settings = []
    for _ in range(rng.choice((1, 1, 2))):
        key = rng.choice(
            (rng.choice(own), ".".join(rng.choice(_numeric_keys())[0]), rng.choice(KEYS))
        )
        text = (
            rng.choice(SETTINGS)
            if rng.random() < 0.7
            else f"{resized(rng, rng.choice((1, 1.0))):g}"
        )
        settings.append(f"{key}={text}".replace("\0", "\x7f"))
    return Broken(files, tuple(settings))


def model_value(rng: random.Random) -> Broken:
    """Attributes and elements of the model are others, are gone, or have company."""
    files = _base(rng, having=".xml")
    file = _ending(files, ".xml")
    root = ElementTree.fromstring(files[file])
    for _ in range(rng.choice((1, 1, 2))):
        found = [(parent, child) for parent in root.iter() for child in parent]
        if not found:
            break
        parent, child = rng.choice(found)
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
    return Broken(files | {file: ElementTree.tostring(root)})


def model_text(rng: random.Random) -> Broken:
    """The model's text is torn, or a number in it is of another size."""
    files = _base(rng, having=".xml")
    file = _ending(files, ".xml")
    return Broken(files | {file: rng.choice((torn, numbers))(rng, files[file])})


def clip_text(rng: random.Random) -> Broken:
    """Words or numbers of the clip are others, or its text is torn."""
    files = bases()["walk"]
    changed = rng.choice((words, words, numbers, torn))(rng, files["walk.bvh"])
    return Broken(files | {"walk.bvh": changed})


def table_text(rng: random.Random) -> Broken:
    """Words or numbers of the table of keyframes are others, or its text is torn."""
    files = bases()["keyframes"]
    return Broken(files | {"keys.csv": rng.choice((words, numbers, torn))(rng, files["keys.csv"])})


def mesh_bytes(rng: random.Random) -> Broken:
    """Bytes of a mesh are others."""
    name = rng.choice(("hull-obj", "hull-stl"))
    files = bases()[name]
    file = f"hull.{name[-3:]}"
    how = rng.choice((words, numbers, torn, torn)) if name == "hull-obj" else torn
    return Broken(files | {file: how(rng, files[file])})


def surface_bytes(rng: random.Random) -> Broken:
    """Bytes of the surface in which flesh grows are others, or a number of its head."""
    files = bases()["skinned"]
    head, mark, body = files["skin.ply"].partition(b"end_header")
    if rng.random() < 0.4:
        return Broken(files | {"skin.ply": rng.choice((words, numbers))(rng, head) + mark + body})
    return Broken(files | {"skin.ply": torn(rng, files["skin.ply"])})


def flesh_bytes(rng: random.Random) -> Broken:
    """Bytes, words, types and counts of the mesh of flesh are others."""
    if rng.random() < 0.3:
        files = bases()["fish-npz"]
        return Broken(files | {"fish.npz": torn(rng, files["fish.npz"])})
    files = bases()["fish"]
    how = rng.choice((words, torn, _retyped, _retyped, _retyped))
    return Broken(files | {"fish.vtu": how(rng, files["fish.vtu"])})


def stranger(rng: random.Random) -> Broken:
    """A file is one of another kind, whose content is nobody's business."""
    files = _base(rng)
    file = rng.choice(list(files))
    secret = rng.choice(
        (b"", b"root:x:0:0:", b"\x89PNG\r\n", b"PK\x03\x04", b"ply\n", b"<", b"solid ")
    )
    return Broken(files | {file: secret + SECRET + b" " + SECRET + b"\n" + SECRET})


def _base(rng: random.Random, having: str = "") -> Files:
    """The files of a base, the quick ones more often."""
    often = {"pendulum": 6, "slab": 4, "swim": 3, "walk": 3, "keyframes": 2, "fish": 1}
    names = [n for n in often if any(name.endswith(having) for name in bases()[n])]
    return dict(bases()[rng.choices(names, [often[n] for n in names])[0]])


def _ending(files: Files, ending: str) -> str:
    return next(name for name in files if name.endswith(ending))


def _scene(files: Files, raw: dict[str, Any]) -> Broken:
    return Broken(files | {"scene.toml": tomli_w.dumps(raw).encode("utf-8", "replace")})


def _paths(raw: Any, at: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The ways to all values in nested tables and lists."""
    for key in raw if isinstance(raw, dict) else range(len(raw)):
        yield (*at, key)
        if isinstance(raw[key], dict | list):
            yield from _paths(raw[key], (*at, key))


@cache
def _numeric_keys() -> list[tuple[tuple[str, ...], str]]:
    """The ways to all keys of scenes that are numbers or made of them, and what they are."""

    def walk(model: Any, at: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], str]]:
        for name, hint in hints_of(model).items():
            inner = list(dict.fromkeys(tables_in(hint)))
            for one in inner:
                yield from walk(one, (*at, name))
            if not inner and ("number" in (kind := said(hint)) or "[x, y" in kind):
                yield (*at, name), kind

    return list(dict.fromkeys(walk(Scene, ())))


def _number(rng: random.Random, kind: str) -> Any:
    """A value for a key of this kind."""
    one = resized(rng, 1 if kind.startswith("whole") else 1.0)
    if "[" in kind or kind.startswith("list"):
        return [one, *([resized(rng)] * rng.randrange(4))]
    return one if rng.random() < 0.9 else rng.choice(NASTY)


def _put(rng: random.Random, raw: dict[str, Any], path: tuple[str, ...], value: Any) -> None:
    """Set a value in nested tables; of a list of tables in one of them."""
    table: Any = raw
    for key in path[:-1]:
        if not isinstance(table.get(key), dict | list):
            table[key] = {}
        table = table[key]
        if isinstance(table, list):
            tables = [one for one in table if isinstance(one, dict)]
            table = rng.choice(tables) if tables else {}
    table[path[-1]] = value


def _retyped(rng: random.Random, text: bytes) -> bytes:
    """An attribute of an XML file of VTK is another one."""
    one = rng.choice(list(re.finditer(rb'="([^"]*)"', text)))
    return text[: one.start(1)] + rng.choice(VTK).encode() + text[one.end(1) :]
