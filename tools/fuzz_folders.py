"""Damaged run folders: bytes, rows, arrays, values and links that no run has written."""

from __future__ import annotations

import json
import os
import random
import shutil
import tomllib
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from fuzz_changes import LONG, SECRET, change, resize, torn

CELLS = ("", "x", "nan", "inf", "1e999", "0x1", "-1", "1,2", '"', "\u0663", "1e300", "\0", LONG)
"""Cells of a history in place of others."""

NAMES = (
    *(
        "../outside/canary.txt",
        "link/canary.txt",
        "states",
        "..",
        ".",
        "",
        LONG,
        "\0",
        "history.csv",
    ),
    *("/etc/hostname", 3, None, {"x": 1}, ["x"], "link", "link/states/000001.npz"),
)
"""Entries of `model_files` in a summary."""

ARRAYS: tuple[Callable[[Any], Any], ...] = (
    *(lambda a: a[:-1], lambda a: a[None], lambda a: a.ravel(), lambda a: np.concatenate([a, a])),
    *(lambda a: a.astype(complex), lambda a: a.astype(str), lambda a: a.astype(object)),
    *(lambda a: a.astype("f4"), lambda a: a.astype("i1"), lambda a: a.astype(bool), lambda a: -a),
    *(lambda a: a * np.nan, lambda a: a * 1e300, lambda a: a * 0, lambda a: a[:0], lambda a: a + 1),
    *(lambda a: np.zeros(a.shape, "M8[s]"), lambda a: np.zeros(a.shape, "V8"), lambda a: a[0]),
    *(lambda a: np.full(a.shape, np.inf), lambda a: np.zeros(a.shape, [("x", "f8")])),
)
"""Arrays of a checkpoint or a state in place of others, of which each has one dimension or more."""

FRAMES = (-1, 0, 1, 2, 10**6, 10**18, 1.5, [3], [1, 2], float("nan"), "3", True)
"""Values of `frame` in a checkpoint."""

UNPACKED = 3 << 30
"""Bytes that a packed array of a few megabytes unpacks to."""


def damage(rng: random.Random, run: Path, outside: Path, kept: Path) -> str:
    """Damage a run folder; what was damaged, in a word.

    outside  folder beside that of the input, which has the files of a run, too
    kept     folder for what takes long to make
    """
    kinds: list[Callable[[], str]] = [
        *[lambda: _torn(rng, run)] * 5,
        *[lambda: _history(rng, run / "history.csv")] * 4,
        *[lambda: _arrays(rng, _an_archive(rng, run))] * 6,
        *[lambda: _values(rng, run)] * 5,
        *[lambda: _linked(rng, run, outside)] * 5,
        lambda: _claim(rng, _an_archive(rng, run), kept),
    ]
    return rng.choice(kinds)()


def _an_archive(rng: random.Random, run: Path) -> Path:
    return rng.choice((run / "checkpoint.npz", *sorted((run / "states").iterdir())))


def _torn(rng: random.Random, run: Path) -> str:
    file = rng.choice(sorted(path for path in run.rglob("*") if path.is_file()))
    file.write_bytes(torn(rng, file.read_bytes()))
    return file.name


def _history(rng: random.Random, file: Path) -> str:
    rows = [line.split(",") for line in file.read_text("utf-8").splitlines()]
    kind = rng.randrange(6)
    one = rng.randrange(len(rows))
    if kind == 0:
        rows.insert(one, rows[0])
    elif kind == 1:
        rows.insert(one, rows[-1])
    elif kind == 2:
        del rows[one]
    elif kind == 3:
        rows[one] = rng.choice((rows[one][:-1], [*rows[one], "1"], []))
    else:
        rows[one][rng.randrange(len(rows[one]))] = rng.choice(CELLS)
    file.write_text("\n".join(map(",".join, rows)) + "\n", "utf-8")
    return "history's rows"


def _arrays(rng: random.Random, file: Path) -> str:
    with np.load(file) as archive:
        arrays: dict[str, Any] = {name: archive[name] for name in archive.files}
    name = rng.choice(list(arrays))
    kind = rng.randrange(8)
    if kind == 0:
        del arrays[name]
    elif kind == 1:
        arrays[rng.choice(("more", "../x", LONG))] = arrays[name]
    elif kind == 2:
        arrays["frame"] = np.array(rng.choice(FRAMES))
    else:
        with np.errstate(all="ignore"):
            arrays[name] = rng.choice(ARRAYS)(np.atleast_1d(arrays[name]))
    np.savez(file, **arrays)
    return f"{file.name}: {name}"


def _values(rng: random.Random, run: Path) -> str:
    name = rng.choice(("summary.json", "summary.json", "model.json", "scene.toml"))
    file = run / name
    if name == "scene.toml":
        raw = tomllib.loads(file.read_text("utf-8"))
        rng.choice((change, resize))(rng, raw)
        file.write_bytes(tomli_w.dumps(raw).encode("utf-8", "replace"))
        return name
    raw = json.loads(file.read_text("utf-8"))
    if rng.random() < 0.2:
        depth = int(10.0 ** rng.uniform(1.0, 5.0))
        texts = ("[" * depth + "]" * depth, "null", "[]", "1" * 5000, SECRET.decode(), "1e999")
        file.write_text('{"flowborne": ' + rng.choice(texts) + "}" * rng.randrange(2), "utf-8")
        return name
    if name == "summary.json" and rng.random() < 0.3:
        raw["model_files"] = rng.choice(
            ([rng.choice(NAMES)], [*raw["model_files"], rng.choice(NAMES)])
        )
    else:
        rng.choice((change, resize))(rng, raw)
    file.write_text(json.dumps(raw), "utf-8")
    return name


def _linked(rng: random.Random, run: Path, outside: Path) -> str:
    """Files or folders are links to what is outside, to nothing, or are no files."""
    if rng.random() < 0.3:
        (run / "link").symlink_to(outside)
        summary = json.loads((run / "summary.json").read_text("utf-8"))
        summary["model_files"].append(rng.choice(("link/canary.txt", "link/model.xml", "link")))
        (run / "summary.json").write_text(json.dumps(summary), "utf-8")
        return "link"
    names = [".lock", "preview.png", ".summary.json.partial", ".history.csv.partial"]
    entry = rng.choice(
        sorted([*(path for path in run.rglob("*")), *(run / name for name in names)])
    )
    if entry.is_dir():
        shutil.rmtree(entry)
    entry.unlink(missing_ok=True)
    kind = rng.randrange(6)
    if kind == 0:
        os.mkfifo(entry)
    elif kind == 1:
        entry.mkdir()
    else:
        targets = (
            outside / entry.relative_to(run),
            outside / "canary.txt",
            outside / "none",
            entry,
        )
        entry.symlink_to(rng.choice((*targets, Path("/dev/zero"))))
    return f"{entry.name} as {('a FIFO', 'a folder')[kind] if kind < 2 else 'a link'}"


def _claim(rng: random.Random, file: Path, kept: Path) -> str:
    """An array claims to be, or is once it is unpacked, far larger than the file."""
    with np.load(file) as archive:
        name = rng.choice(archive.files)
    if rng.random() < 0.5:
        count = int(10.0 ** rng.uniform(6.0, 15.0))
        with zipfile.ZipFile(file, "w") as made, made.open(f"{name}.npy", "w") as member:
            np.lib.format.write_array_header_1_0(member, _head(count))
        return f"{file.name}: {name}, which claims {count} numbers"
    packed = kept / "packed.npz"
    if not packed.is_file():
        packed.parent.mkdir(parents=True, exist_ok=True)
        partial = packed.with_name(f"{os.getpid()}.npz")
        with (
            zipfile.ZipFile(partial, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as made,
            made.open("frame.npy", "w", force_zip64=True) as member,
        ):
            np.lib.format.write_array_header_1_0(member, _head(UNPACKED // 8))
            for _ in range(UNPACKED >> 24):
                member.write(bytes(1 << 24))
        partial.replace(packed)
    shutil.copy(packed, file)
    return f"{file.name}, packed"


def _head(count: int) -> dict[str, Any]:
    """The head of an array of so many numbers."""
    return {"descr": "<f8", "fortran_order": False, "shape": (count,)}
