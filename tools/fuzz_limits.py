"""Broken scenes that ask for more than there is: counts, endless files, nesting, claims."""

from __future__ import annotations

import random
import tomllib
from typing import Any

import tomli_w

from fuzz_bases import Broken, bases
from fuzz_changes import LONG, OUTSIDE

COUNTS: tuple[tuple[str, ...], ...] = (
    ("controller", "knots"),
    ("controller", "every"),
    ("controller", "iterations"),
    ("controller", "settle_steps"),
    ("controller", "hypothetical_steps"),
    ("controller", "rule", "gradients"),
    ("time", "steps_per_frame"),
    ("time", "frames"),
    ("domain", "resolution"),
    ("film", "size"),
    ("dye", "count"),
    ("flesh", "size"),
    ("output", "checkpoint_every"),
)
"""Keys of scenes that say how much work there is."""

ENDLESS = ("/dev/zero", "/dev/urandom", "/dev/full", "", ".", "none", OUTSIDE, "/proc/self/environ")
"""Where links point to in place of files; "" is a FIFO."""


def work(rng: random.Random) -> Broken:
    """A scene asks for more work, or larger pictures, than it can be given."""
    name = rng.choice(("pendulum", "slab", "swim", "skinned"))
    raw: dict[str, Any] = tomllib.loads(bases()[name]["scene.toml"].decode())
    for path in rng.sample(COUNTS, rng.choice((1, 1, 2))):
        table: Any = raw
        for key in path[:-1]:
            table = table.setdefault(key, {})
            table = table[0] if isinstance(table, list) else table
        count = int(10.0 ** rng.uniform(0.5, 20.0))
        table[path[-1]] = [2 * count, 128] if path[-1] == "size" and path[0] == "film" else count
    if rng.random() < 0.2:
        raw.setdefault("controller", {})["rule"] = {"kind": "quasi-newton"}
    return Broken(bases()[name] | {"scene.toml": tomli_w.dumps(raw).encode()})


def endless(rng: random.Random) -> Broken:
    """A file has no end, or is none."""
    name = rng.choice(list(bases()))
    files = bases()[name]
    own = [file for file in files if file != "scene.toml" or rng.random() < 0.2]
    return Broken(files, links={rng.choice(own): rng.choice(ENDLESS)})


def nested(rng: random.Random) -> Broken:
    """Bodies, joints, tables or arrays are nested deep."""
    depth = int(10.0 ** rng.uniform(1.0, 3.7))
    kind = rng.randrange(4)
    if kind == 0:
        body = '<body name="b{}" pos="0 0 1"><joint name="j{}"/><geom size="0.1"/>'
        inner = "".join(body.format(n, n) for n in range(depth)) + "</body>" * depth
        model = bases()["pendulum"]["model.xml"].decode()
        model = model.replace('<body name="hand"', inner + '<body name="hand"', 1)
        return Broken(bases()["pendulum"] | {"model.xml": model.encode()})
    if kind == 1:
        inner = "<default>" * depth + "</default>" * depth
        model = bases()["slab"]["model.xml"].decode().replace("<default>", "<default>" + inner, 1)
        return Broken(bases()["slab"] | {"model.xml": model.encode()})
    if kind == 2:
        joint = "JOINT j{}\n{{\nOFFSET 0 0 1\nCHANNELS 3 Zrotation Xrotation Yrotation\n"
        inner = "".join(joint.format(n) for n in range(depth)) + "End Site\n{\nOFFSET 0 0 1\n}\n"
        head = f"HIERARCHY\nROOT r\n{{\nOFFSET 0 0 0\n{inner}{'}' * depth}\n}}\n"
        clip = f"{head}MOTION\nFrames: 2\nFrame Time: 0.04\n" + ("0 " * 3 * depth + "\n") * 2
        return Broken(bases()["walk"] | {"walk.bvh": clip.encode()})
    text = rng.choice(("x = " + "[" * depth + "]" * depth, "[" + "x." * depth + "x]\ny = 1"))
    return Broken(
        bases()["pendulum"] | {"scene.toml": bases()["pendulum"]["scene.toml"] + text.encode()}
    )


def claimed(rng: random.Random) -> Broken:
    """A file says that it holds far more than it does."""
    count = str(int(10.0 ** rng.uniform(2.0, 20.0))).encode()
    name, file, old, new = rng.choice(
        (
            ("walk", "walk.bvh", b"Frames:", b"Frames: " + count + b"\n#"),
            ("walk", "walk.bvh", b"CHANNELS 3", b"CHANNELS " + count),
            ("fish", "fish.vtu", b'NumberOfPoints="226"', b'NumberOfPoints="' + count + b'"'),
            ("fish", "fish.vtu", b'NumberOfCells="661"', b'NumberOfCells="' + count + b'"'),
            ("fish", "fish.vtu", b'NumberOfTuples="1"', b'NumberOfTuples="' + count + b'"'),
            ("fish", "fish.vtu", b"AQAAAACAAAAwFQAA", b"////fwCAAAAwFQAA"),
            ("skinned", "skin.ply", b"element vertex 42", b"element vertex " + count),
            ("skinned", "skin.ply", b"element face 80", b"element face " + count),
            ("hull-obj", "hull.obj", b"f ", b"f " + count + b" "),
            ("hull-stl", "hull.stl", b"\x50\0\0\0", rng.randbytes(4)),
        )
    )
    content = bases()[name][file]
    return Broken(bases()[name] | {file: content.replace(old, new, 1)})


def long_name(rng: random.Random) -> Broken:
    """A name of bodies, joints, files or columns is far too long."""
    name = rng.choice(list(bases()))
    files = dict(bases()[name])
    text = files["scene.toml"] + files.get("model.xml", b"")
    quoted = [part for part in text.split(b'"')[1::2] if part[:1].isalpha()]
    old = rng.choice(quoted)
    new = rng.choice((LONG.encode(), b"a" * 100_000, b"a" * 251 + old, b"\xc3\xa9" * 130))
    changed = {f: c.replace(b'"' + old + b'"', b'"' + new + b'"') for f, c in files.items()}
    if old.decode() in files and len(new) < 256:
        changed[new.decode()] = files[old.decode()]
    return Broken(changed)
