"""Broken characters for `flowborne import`: glTF and USD, as trees of values and as bytes."""

from __future__ import annotations

import base64
import json
import random
import runpy
import struct
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from fuzz_bases import Broken
from fuzz_changes import OUTSIDE, change, numbers, places, resize, torn, words

RIGGED = Path(__file__).parents[1] / "tests" / "characters" / "rigged.py"

WHOLE = (-1, 0, 1, 2, 3, 5, 255, 5120, 5125, 5126, 65_535, 10**6, 2**31 - 1, 2**31, 2**53, 2**64)

FLOATS = (float("nan"), float("inf"), -float("inf"), 0.0, 1e30, -1e30, 1e-30, 3e38, 1e6, 1e-45)

URIS = (
    *("", "none.bin", ".", "/dev/zero", "/dev/urandom", "data:", "data:;base64,@@", "data:x,AAAA"),
    *("http://localhost/x.bin", "file:///dev/zero", "%00", "a" * 300, "box.glb", "box.gltf"),
)
"""Addresses of buffers that cannot be read."""

ELSEWHERE = (
    *(f"{OUTSIDE}/box.bin", "../outside/box.bin", "..%2Foutside%2Fbox.bin", "./../outside/box.bin"),
    *(
        f"file://{OUTSIDE}/box.bin",
        "%2E%2E/outside/box.bin",
        "link/box.bin",
        "..\\outside\\box.bin",
    ),
)
"""Addresses of a buffer outside the character's folder: none may be read."""


@cache
def rigged() -> dict[str, bytes]:
    """A rigged box, as glTF and as USD."""
    box = runpy.run_path(str(RIGGED))
    with TemporaryDirectory() as folder:
        for name, write in (
            ("box.glb", "write_glb"),
            ("box.usda", "write_usd"),
            ("box.usdc", "write_usd"),
        ):
            box[write](Path(folder) / name)
        return {path.name: path.read_bytes() for path in Path(folder).iterdir()}


def _parts() -> tuple[dict[str, Any], bytes]:
    """The box's tree and its buffer."""
    content = rigged()["box.glb"]
    (length,) = struct.unpack_from("<I", content, 12)
    return json.loads(content[20 : 20 + length]), content[28 + length :]


def sound_buffer() -> bytes:
    """The buffer of the box."""
    return _parts()[1]


def _glb(tree: Any, buffer: bytes) -> bytes:
    """A .glb file of these."""
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    buffer += b"\0" * (-len(buffer) % 4)
    head = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(buffer))
    return (
        head
        + struct.pack("<I4s", len(text), b"JSON")
        + text
        + struct.pack("<I4s", len(buffer), b"BIN\0")
        + buffer
    )


def _written(rng: random.Random, tree: Any, buffer: bytes) -> Broken:
    """As one file, or as two."""
    if rng.random() < 0.7:
        return Broken({"box.glb": _glb(tree, buffer)})
    data = "data:application/octet-stream;base64," + base64.b64encode(buffer).decode()
    with suppress(IndexError, KeyError, TypeError):
        tree["buffers"][0]["uri"] = rng.choice(("box.bin", data))
    return Broken({"box.gltf": json.dumps(tree).encode(), "box.bin": buffer})


def tree(rng: random.Random) -> Broken:
    """Indices, counts, offsets, kinds and numbers of a glTF are others."""
    made, buffer = _parts()
    for _ in range(rng.choice((1, 1, 2))):
        kind = rng.randrange(4)
        whole = [(t, k) for t, k in places(made) if type(t[k]) is int]
        if kind <= 1:
            table, key = rng.choice(whole)
            table[key] = rng.choice((*WHOLE, table[key] + 1, table[key] - 1))
        elif kind == 2:
            resize(rng, made)
        else:
            change(rng, made)
    return _written(rng, made, buffer)


def values(rng: random.Random) -> Broken:
    """Numbers in the buffer of a glTF are none, huge, tiny, or others."""
    made, buffer = _parts()
    view = rng.choice(made["bufferViews"])
    size, number = rng.choice(((4, "<f"), (4, "<f"), (1, "<B"), (2, "<H")))
    data = bytearray(buffer)
    for _ in range(rng.choice((1, 1, 3, 1000))):
        at = view.get("byteOffset", 0) + size * rng.randrange(view["byteLength"] // size)
        struct.pack_into(
            number, data, at, rng.choice(FLOATS) if number == "<f" else rng.randrange(256)
        )
    return _written(rng, made, bytes(data))


def graph(rng: random.Random) -> Broken:
    """Nodes of a glTF share children, go round, or are nested deep."""
    made, buffer = _parts()
    nodes = made["nodes"]
    kind = rng.randrange(5)
    if kind == 0:
        nodes[rng.randrange(len(nodes))]["children"] = [
            rng.randrange(len(nodes)) for _ in range(rng.randrange(1, 4))
        ]
    elif kind == 1:
        count, first = rng.choice((5, 30, 60)), len(nodes)
        nodes += [{"name": f"n{n}", "children": [first + n + 1] * 2} for n in range(count)] + [{}]
        nodes[rng.randrange(first)].setdefault("children", []).append(first)
    elif kind == 2:
        count, first = int(10.0 ** rng.uniform(1.0, 4.5)), len(nodes)
        nodes += [{"name": f"n{n}", "children": [first + n + 1]} for n in range(count)] + [{}]
        nodes[rng.randrange(first)].setdefault("children", []).append(first)
        made["skins"][0]["joints"] += rng.choice(
            ([], [first + count], list(range(first, first + count)))
        )
    elif kind == 3:
        joints = made["skins"][0]["joints"]
        joints[:] = [rng.choice((*joints, 0, 5, 99, -1)) for _ in range(rng.randrange(6))]
    else:
        made["skins"].append(json.loads(json.dumps(made["skins"][0])))
        made["nodes"][5]["skin"] = rng.choice((0, 1, 2))
    return _written(rng, made, buffer)


def address(rng: random.Random) -> Broken:
    """The buffer of a glTF is at an address that cannot be read."""
    made, buffer = _parts()
    made["buffers"][0]["uri"] = rng.choice(URIS)
    return Broken({"box.gltf": json.dumps(made).encode(), "box.bin": torn(rng, buffer)})


def elsewhere(rng: random.Random) -> Broken:
    """The buffer of a glTF is outside its folder."""
    made, _ = _parts()
    made["buffers"][0]["uri"] = rng.choice(ELSEWHERE)
    return Broken({"box.gltf": json.dumps(made).encode()}, links={"link": OUTSIDE})


def claim(rng: random.Random) -> Broken:
    """A glTF says that it holds far more than it does."""
    made, buffer = _parts()
    one = rng.choice(made["accessors"])
    one["count"] = int(10.0 ** rng.uniform(1.0, 19.0))
    kind = rng.randrange(4)
    if kind == 0:
        one.pop("bufferView")
    elif kind == 1:
        rng.choice(made["bufferViews"])["byteLength"] = one["count"]
        made["buffers"][0]["byteLength"] = one["count"]
    elif kind == 2:
        rng.choice(made["bufferViews"])["byteStride"] = rng.choice((0, 1, 3, 252, 10**9, -4))
    else:
        index = {"bufferView": 0, "componentType": 5125}
        one["sparse"] = {"count": one["count"], "indices": index, "values": {"bufferView": 1}}
    return _written(rng, made, buffer)


def nested(rng: random.Random) -> Broken:
    """The JSON of a glTF is nested deep, or is something else."""
    depth = int(10.0 ** rng.uniform(1.0, 5.5))
    text = rng.choice(
        (
            "[" * depth + "]" * depth,
            '{"a":' * depth + "1" + "}" * depth,
            "null",
            "[]",
            "{}",
            "1" * 5000,
        )
    )
    if rng.random() < 0.5:
        text = '{"asset": {"version": "2.0"}, "extras": ' + text + "}"
    return Broken({"box.gltf": text.encode()})


def glb_bytes(rng: random.Random) -> Broken:
    """Bytes of a .glb file are others, or its first ones."""
    content = rigged()["box.glb"]
    if rng.random() < 0.3:
        return Broken({"box.glb": torn(rng, content[:28]) + content[28:]})
    return Broken({"box.glb": torn(rng, content)})


def usd(rng: random.Random) -> Broken:
    """Words, numbers or bytes of a USD file are others."""
    if rng.random() < 0.25:
        return Broken({"box.usdc": torn(rng, rigged()["box.usdc"])})
    how: Callable[[random.Random, bytes], bytes] = rng.choice(
        (words, words, numbers, numbers, torn)
    )
    return Broken({"box.usda": how(rng, rigged()["box.usda"])})


def endless(rng: random.Random) -> Broken:
    """The character, or its buffer, has no end, or is none."""
    made, buffer = _parts()
    made["buffers"][0]["uri"] = "box.bin"
    files = {"box.gltf": json.dumps(made).encode(), "box.bin": buffer}
    name = rng.choice(("box.gltf", "box.bin", "box.glb", "box.usda", "box.usdc"))
    files = files if name in files else {}
    return Broken(files, links={name: rng.choice(("/dev/zero", "/dev/urandom", "", ".", "none"))})


def option(rng: random.Random) -> Broken:
    """The options of the command are none."""
    texts = (
        "nan",
        "inf",
        "0",
        "-1",
        "1e-320",
        "1e308",
        "x",
        "",
        "a" * 300,
        "Swim 0",
        "../x",
        "\u202e",
    )
    names = rng.sample(("--density", "--clip", "--animations"), rng.choice((1, 1, 2)))
    options = [part for name in names for part in (name, rng.choice((*texts, "box.glb")))]
    return Broken({"box.glb": rigged()["box.glb"]}, tuple(options))
