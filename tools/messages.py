"""What flowborne says to mistakes that people make, as a table: the end of docs/attack.md."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pyvista as pv

from flowborne.runs.run_folder import RunFolder
from fuzz_bases import ARM, KEYFRAMES, Files, bases
from fuzz_judge import Said, command
from marked import with_part

PAGE = Path(__file__).parents[1] / "docs" / "attack.md"

CHECK = ("check", "scene.toml")
TRUSTED = (*CHECK, "--trust")
RUN = ("run", "scene.toml", "--out", "run", "--no-film", "--workers", "1")

PLY = (
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n0 1 0\n3 0 1 200\n"
)

ACCEPTED = "none: it is accepted"
"""In place of a message. `check` and `run` may still warn that the scene is implausible."""

Mistake = tuple[str, str, Files, tuple[str, ...]]
"""What somebody did, the base it was done to, the files that changed, and the last command."""


def edited(base: str, file: str, old: str, new: str) -> Files:
    """A file of a base with a text in place of another, which it has."""
    text = bases()[base][file].decode()
    if old not in text:
        raise ValueError(f"{old!r} is not in {file} of {base}")
    return {file: text.replace(old, new, 1).encode()}


def scene(base: str, old: str, new: str) -> Files:
    return edited(base, "scene.toml", old, new)


def model(old: str, new: str) -> Files:
    return edited("pendulum", "model.xml", old, new)


def wind(module: str, body: str) -> Files:
    """The pendulum with a wind in Python; a process imports a module once."""
    text = f'plugins = ["{module}.py"]\n' + bases()["pendulum"]["scene.toml"].decode()
    text += f'[[wind]]\nkind = "python"\nfunction = "{module}:blow"\n'
    return {"scene.toml": text.encode(), f"{module}.py": body.encode()}


def single_precision() -> Files:
    """Holders as numbers of single precision."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "fish.vtu"
        path.write_bytes(bases()["fish"]["fish.vtu"])
        grid = pv.read(path)
        grid.point_data["holder"] = np.asarray(grid.point_data["holder"], np.float32) + 0.5
        grid.save(path)
        text = scene("fish", "thickness = 0.12\nsize = 0.25\n", "")
        return text | {"fish.vtu": path.read_bytes()}


def mistakes() -> Iterator[Mistake]:
    """All of them, kind after kind."""
    bare = bases()["walk"]["scene.toml"].decode().replace('file = "walk.bvh"\nunit = 0.01\n', "")
    for old, new in (("mass = 70.0", "mass = -3"), ("mass = 70.0", 'sex = "x"')):
        changed = {"scene.toml": bare.replace(old, new).encode()}
        yield f"`[human]` {new} beside a walk without file", "walk", changed, CHECK
    yield (
        "a joint misspelt in `[initial]`",
        "walk",
        scene("walk", "lower_back =", "lowr_back ="),
        CHECK,
    )
    yield (
        "`domain.resolution` -1",
        "fish",
        scene("fish", "resolution = 12", "resolution = -1"),
        CHECK,
    )
    yield ("a clip in the wrong unit", "walk", scene("walk", "unit = 0.01", "unit = 1.0"), CHECK)
    yield (
        "a loop whose ends differ, joined in 0.02 s",
        "walk",
        scene("walk", "blend = 0.05", "start = 0.2\nstop = 0.9\nloop = true\nblend = 0.02"),
        CHECK,
    )
    yield ("a person of no mass", "walk", scene("walk", "mass = 70.0", "mass = 1e-300"), CHECK)
    yield ("a skin of 1e18 m", "fish", scene("fish", "thickness = 0.12", "thickness = 1e18"), CHECK)
    yield (
        "1e18 steps in a frame",
        "slab",
        scene("slab", "frames = 3", f"frames = 3\nsteps_per_frame = {10**18}"),
        CHECK,
    )
    yield (
        "a ball joint that starts at three numbers",
        "pendulum",
        scene("pendulum", "hinge = 40.0", "hinge = 40.0, wrist = [1.0, 2.0, 3.0]"),
        CHECK,
    )
    yield "bones of a `.vtu` as fractions", "fish", single_precision(), CHECK
    yield "a model with two roots", "pendulum", {"model.xml": ARM.encode() * 2}, CHECK
    yield (
        "a model with entities",
        "pendulum",
        {"model.xml": b'<!DOCTYPE m [<!ENTITY a "b">]>' + ARM.encode()},
        CHECK,
    )
    yield (
        "frames of 5000 digits",
        "slab",
        scene("slab", "frames = 3", f"frames = {'9' * 5000}"),
        CHECK,
    )
    deep = b"a = " + b"[" * 3000 + b"]" * 3000
    yield "arrays nested 3000 deep", "slab", {"scene.toml": deep}, CHECK
    long = scene("pendulum", "model.xml", f"{'m' * 300}.xml")
    yield "a model's name of 300 letters", "pendulum", long, CHECK
    yield (
        "a wind in Python, not yet read",
        "pendulum",
        wind("unread", "def blow(x, time):\n    return x\n"),
        CHECK,
    )
    yield (
        "a wind that ends the interpreter",
        "pendulum",
        wind("leaving", "import sys\nsys.exit(0)\n"),
        TRUSTED,
    )
    for said, body in (
        ("raises", "1 / 0"),
        ("gives text", "return 'x'"),
        ("gives nothing", "pass"),
    ):
        text = f"def blow(x, time):\n    {body}\n"
        yield f"a wind that {said}", "pendulum", wind(said.split()[-1], text), TRUSTED
    yield "a PLY whose faces point past its vertices", "skinned", {"skin.ply": PLY.encode()}, CHECK
    for old, new in (
        ('stiffness="0.5"', 'stiffness="nan"'),
        ('stiffness="0.5"', 'stiffness="-5"'),
        ('damping="0.1"', 'damping="inf"'),
        ('damping="0.1"', 'damping="-1"'),
        ('armature="0.01"', 'armature="-1"'),
        ('frictionloss="0.01"', 'frictionloss="nan"'),
        ('axis="0 1 0"', 'axis="nan 0 1"'),
        ('range="-90 90"', 'range="90 -90"'),
        ('density="300"', 'density="nan"'),
        ('density="300"', 'mass="-1"'),
        ('pos="0 0 -0.5"', 'pos="inf 0 0"'),
    ):
        yield f"`{new}` in a model", "pendulum", model(old, new), CHECK
    tendon = '<tendon><fixed><joint joint="hinge" coef="nan"/></fixed></tendon></mujoco>'
    yield "a tendon's coefficient nan", "pendulum", model("</mujoco>", tendon), CHECK
    equal = (
        '<equality><joint joint1="hinge" joint2="rail" polycoef="nan 1 0 0 0"/></equality></mujoco>'
    )
    yield "an equality's coefficient nan", "pendulum", model("</mujoco>", equal), CHECK
    heights = (
        '<asset><hfield name="h" nrow="90000" ncol="90000" size="1 1 1 1"/></asset><worldbody>'
    )
    yield "a height field of gigabytes", "pendulum", model("<worldbody>", heights), CHECK
    flex = '<worldbody><flexcomp type="grid" count="900 900 900" spacing="1 1 1" dim="3" name="f"/>'
    yield "a flex of gigabytes", "pendulum", model("<worldbody>", flex), CHECK
    many = '<worldbody><replicate count="1000000"><geom size="0.1"/></replicate>'
    yield "a million replicates", "pendulum", model("<worldbody>", many), CHECK
    yield (
        "a grid of gigabytes",
        "slab",
        scene("slab", "resolution = 16", "resolution = 1000000"),
        CHECK,
    )
    yield "keyframes that are something else", "keyframes", {"keys.csv": b"root:x:0:0\n"}, CHECK
    comma = {
        "model.xml": ARM.replace('"hinge"', '"a,b"').encode(),
        "scene.toml": KEYFRAMES.replace(
            'joint = "hinge"', 'joint = "a,b"\ncolumn = "hinge"'
        ).encode(),
    }
    yield "a joint called `a,b`", "keyframes", comma, RUN
    named = scene("walk", "walk.bvh", "clips/summary.json")
    named["clips/summary.json"] = bases()["walk"]["walk.bvh"]
    yield "a clip called `summary.json`", "walk", named, RUN


def of_folders(run: RunFolder) -> Iterator[tuple[str, Path | None, bytes]]:
    """What happened to a run, the file that it happened to, and what that holds now."""
    yield "a state emptied by a loss of power", run.state(1), b""
    yield "a checkpoint cut by it", run.checkpoint, run.checkpoint.read_bytes()[:300]
    yield "a checkpoint of another kind", run.checkpoint, run.state(1).read_bytes()
    yield "a history of foreign bytes", run.history, b"\xff\xfe" * 100
    yield "a second run into the folder of one that goes on", None, b""


def put(files: Files) -> None:
    """Write files here."""
    for name, content in files.items():
        Path(name).parent.mkdir(exist_ok=True)
        Path(name).write_bytes(content)


def rows() -> Iterator[tuple[str, Said]]:
    """What somebody did, and what flowborne says."""
    for what, base, changed, last in mistakes():
        with TemporaryDirectory() as folder, contextlib.chdir(folder):
            put(bases()[base] | changed)
            yield what, command(*last)
    with TemporaryDirectory() as folder, contextlib.chdir(folder):
        put(bases()["pendulum"])
        command(*RUN)
        run, again = RunFolder(Path("run")), (*RUN, "--resume", "--frames", "5")
        for what, path, now in of_folders(run):
            if path is None:
                with run.locked():
                    yield what, command(*again)
                continue
            before = path.read_bytes()
            path.write_bytes(now)
            yield what, command(*again)
            path.write_bytes(before)


def table() -> str:
    """The rows in Markdown."""
    lines = ["| mistake | message |", "| --- | --- |"]
    for what, said in rows():
        message = " ".join(line.removeprefix("flowborne: ") for line in said.messages)
        message = message or (ACCEPTED if said.code == 0 else "NONE")
        for letter in "|<*_":
            message = message.replace(letter, f"\\{letter}")
        lines.append(f"| {what} | {message} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    made = table()
    PAGE.write_text(with_part(PAGE.read_text("utf-8"), "messages", made), "utf-8")
