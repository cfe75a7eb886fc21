"""Models that nobody here made, through load, check, six frames and a picture: docs/strangers.md.

`make strangers` fetches wheels of PyPI that carry MJCF and URDF models, writes for each model the
scene that a newcomer would write, and gives it to `flowborne check` and `flowborne run`, each in a
process of its own with a time limit. What came of a model is kept in build/strangers/ and not tried
again after a stop; without that folder it begins anew. Nothing of the wheels is committed.
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import json
import re
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter
from typing import Any, NamedTuple
from xml.etree import ElementTree

import mujoco
import numpy as np
import tomli_w

from flowborne.solids.mjcf import Given, bones_of
from markdown_text import plain, table
from marked import with_part

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "strangers.md"
KEPT = ROOT / "build" / "strangers"

WHEELS = (
    "dm_control==1.0.50",
    "gymnasium==1.4.0",
    "gymnasium-robotics==1.4.2",
    "example-robot-data==6.0.0",
    "robot_descriptions==3.3.0",
)
"""Distributions that carry models, and the versions that the page speaks of."""

SECONDS = 300.0
"""Longest that `check`, or a run with its picture, may take."""

FRAMES, RESOLUTION = 6, 48

MARGIN = 0.5
"""Room around a creature in its domain, in its longest extents."""

SAY_NOTHING = ("cmeel.prefix", "share", "robots", "envs", "assets")
"""Folders of the wheels that the page leaves out."""

LONGEST = 300
"""Most letters of a message in the table."""

ANSWERS = {
    'mend = "hull"': {"solids.mend": "hull"},
    "enlarge the domain": {"domain": "around the world's geoms too"},
    "or enlarge the domain": {"room": "twice as much"},
    "enlarge [domain]": {"room": "twice as much"},
    "refine the grid where": {"resolution": "a third more"},
}
"""What a message may propose -> what is then tried."""


class Stranger(NamedTuple):
    """What came of a model.

    model     its path in the wheels
    mujoco    what plain MuJoCo says against it; "" when it loads it
    refused   what flowborne says against it; "" when `check` accepts its scene
    edits     keys that the minimal scene lacked
    warnings  number of warnings
    ran       "" when the run and its picture came out, else what it said
    seconds   of `check`, and of the run
    """

    model: str
    mujoco: str
    refused: str = ""
    edits: tuple[str, ...] = ()
    warnings: int = 0
    ran: str = ""
    seconds: tuple[float, float] = (0.0, 0.0)

    @property
    def runs(self) -> bool:
        return not (self.refused or self.ran)


def fetched(wheels: Path) -> Path:
    """The folder in which the wheels lie unpacked, each in a folder of its name."""
    unpacked = KEPT / "models"
    for wanted in WHEELS:
        name = wanted.partition("==")[0].replace("-", "_")
        if (unpacked / name).is_dir():
            continue
        if not any(wheels.glob(f"{name}-*.whl")):
            options = ["--no-deps", "--only-binary", ":all:", "--dest", str(wheels)]
            pip = [sys.executable, "-m", "pip", "download", "--quiet", *options, wanted]
            subprocess.run(pip, check=True)
        (wheel,) = wheels.glob(f"{name}-*.whl")
        partial = unpacked / f"{name}.partial"
        shutil.rmtree(partial, ignore_errors=True)
        with zipfile.ZipFile(wheel) as archive:
            archive.extractall(partial)
        partial.rename(unpacked / name)
    return unpacked


def models(folder: Path) -> Iterator[Path]:
    """MJCF and URDF files with a model in them, of those that are the same only the first."""
    seen = set[bytes]()
    for path in sorted([*folder.rglob("*.xml"), *folder.rglob("*.urdf")]):
        text = path.read_bytes()
        digest = hashlib.sha256(path.name.encode() + text).digest()
        try:
            root = ElementTree.fromstring(text).tag
        except ElementTree.ParseError:
            continue
        if root in ("mujoco", "robot") and digest not in seen:
            seen.add(digest)
            yield path


def extent(mj: mujoco.MjModel, whole: bool) -> tuple[np.ndarray, np.ndarray]:
    """Corners (3,) of a box around all that moves at rest, m; around all that there is where
    nothing moves, or if `whole`."""
    data = mujoco.MjData(mj)
    mujoco.mj_kinematics(mj, data)
    solid = ~np.isin(mj.geom_type, (mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD))
    moving = solid & (mj.body_weldid[mj.geom_bodyid] > 0)
    low, high = [], []
    for geom in np.flatnonzero(moving if moving.any() and not whole else solid):
        turn = data.geom_xmat[geom].reshape(3, 3)
        centre = data.geom_xpos[geom] + turn @ mj.geom_aabb[geom, :3]
        half = np.abs(turn) @ mj.geom_aabb[geom, 3:]
        low.append(centre - half)
        high.append(centre + half)
    if not low:
        return np.zeros(3), np.ones(3)
    return np.min(low, axis=0), np.max(high, axis=0)


def scene_of(path: Path, edits: dict[str, Any]) -> dict[str, Any]:
    """The scene that a newcomer would write: water around the creature, and its model."""
    low, high = np.zeros(3), np.ones(3)
    with contextlib.suppress(ValueError):
        given = Given(hulls="solids.mend" in edits)
        low, high = extent(bones_of(path, False, (0.0, 0.0, 0.0), given)[1], "domain" in edits)
    margin = MARGIN * float((high - low).max()) * (2.0 if "room" in edits else 1.0)
    return {
        "gravity": [0.0, 0.0, -9.81],
        "time": {"frames_per_second": 30.0, "frames": FRAMES},
        "domain": {
            "lower": (low - margin).round(6).tolist(),
            "upper": (high + margin).round(6).tolist(),
            "resolution": RESOLUTION * 4 // 3 if "resolution" in edits else RESOLUTION,
        },
        "fluid": {"density": 1000.0, "viscosity": 1e-3},
        "solids": {"model": str(path)}
        | {key.removeprefix("solids."): edits[key] for key in edits if key.startswith("solids.")},
    }


def said(*arguments: str) -> tuple[str, str]:
    """What a command of flowborne says on stdout, and its message when it fails, else ""."""
    command = [sys.executable, "-m", "flowborne", *arguments]
    try:
        done = subprocess.run(command, capture_output=True, timeout=SECONDS, text=True)
    except subprocess.TimeoutExpired:
        return "", f"no end in {SECONDS:g} s"
    if done.returncode == 0:
        return done.stdout, ""
    lines = [line for line in done.stderr.splitlines() if line.strip()]
    messages = [line.removeprefix("flowborne: ") for line in lines if line.startswith("flowborne")]
    return done.stdout, " ".join(messages) or f"exit code {done.returncode}: {lines[-1:]}"


def tried(path: Path, name: str, folder: Path) -> Stranger:
    """What comes of a model whose scene and run lie in `folder`."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    scene, edits = folder / "scene.toml", dict[str, Any]()
    refusal = mujoco_refusal(path)
    while True:
        scene.write_text(tomli_w.dumps(scene_of(path, edits)), "utf-8")
        began = perf_counter()
        out, refused = said("check", str(scene))
        checked, ran, began = perf_counter() - began, "", perf_counter()
        if not refused:
            _, ran = said("run", str(scene), "--out", str(folder / "run"), "--replace")
            if not ran and not (folder / "run" / "preview.png").is_file():
                ran = "no picture"
        seconds = checked, 0.0 if refused else perf_counter() - began
        proposed = [keys for text, keys in ANSWERS.items() if text in (refused or ran)]
        answer = next((keys for keys in proposed if keys.keys() - edits.keys()), {})
        if not answer:
            break
        edits |= answer
    found = re.search(r"^(\d+) warning", out, re.M)
    warnings = int(found[1]) if found else 0
    return Stranger(name, refusal, refused, tuple(edits), warnings, ran, seconds)


def mujoco_refusal(path: Path) -> str:
    """What plain MuJoCo says against a model; "" when it loads it."""
    load = "import mujoco, sys; mujoco.MjModel.from_xml_path(sys.argv[1])"
    done = subprocess.run([sys.executable, "-c", load, str(path)], capture_output=True, text=True)
    if done.returncode == 0:
        return ""
    said = " ".join(done.stderr.partition("ValueError: ")[2].split())
    return said or f"exit code {done.returncode}"


def outcomes(folder: Path, some: str) -> list[Stranger]:
    """What came of every model whose path has `some` in it, now or in an earlier attempt."""
    kept = KEPT / "found.jsonl"
    lines = kept.read_text("utf-8").splitlines() if kept.is_file() else []
    found = {one.model: one for one in (read(line) for line in lines)}
    chosen = [path for path in models(folder) if some in str(path.relative_to(folder))]
    with kept.open("a", encoding="utf-8") as file:
        for path in chosen:
            name = str(path.relative_to(folder))
            if name not in found:
                found[name] = tried(path, name, KEPT / "runs" / name)
                print(json.dumps(found[name]), file=file, flush=True)
                print(told(found[name]), flush=True)
    return [found[str(path.relative_to(folder))] for path in chosen]


def read(line: str) -> Stranger:
    """A line of what is kept."""
    model, refusal, refused, edits, warnings, ran, seconds = json.loads(line)
    return Stranger(model, refusal, refused, tuple(edits), warnings, ran, tuple(seconds))


def told(one: Stranger) -> str:
    """A line for people."""
    end = "runs" if one.runs else one.refused or one.ran
    return f"{one.model}: {end} ({', '.join(f'{s:.0f} s' for s in one.seconds)})"


def page(found: list[Stranger]) -> str:
    """The part of the page that this tool writes."""
    loaded = [one for one in found if not one.mujoco]
    others = [one for one in found if one.mujoco]
    lines = [
        f"{len(loaded)} models that plain MuJoCo {mujoco.__version__} loads: "
        f"{sum(one.runs for one in loaded)} run "
        f"({sum(one.runs and bool(one.edits) for one in loaded)} of them with a key that a message "
        f"proposes), {sum(bool(one.refused) for one in loaded)} refused in a message, "
        f"{sum(bool(one.ran) for one in loaded)} failing after `check` accepted it. "
        f"{len(others)} models that it does not load: {sum(one.runs for one in others)} run.\n",
        table(
            ["model", "loads", "edits", "warnings", "runs"],
            [row(one) for one in found if not one.mujoco or one.runs],
        ),
        "Models that neither plain MuJoCo nor flowborne loads:\n",
        table(
            ["model", "MuJoCo", "flowborne"],
            [
                [short(one.model), shown(one.mujoco), shown(one.refused or one.ran)]
                for one in others
                if not one.runs
            ],
        ),
    ]
    return "\n".join(lines)


def row(one: Stranger) -> list[str]:
    """A row of the table of models that load."""
    edits = ", ".join(f"`{key}`" for key in one.edits) or "none"
    loads = shown(one.refused) if one.refused else "yes"
    runs = "" if one.refused else shown(one.ran) if one.ran else "yes"
    return [short(one.model), loads, edits, "" if one.refused else str(one.warnings), runs]


def short(name: str) -> str:
    """A model's path without the folders that say nothing."""
    return plain("/".join(part for part in Path(name).parts if part not in SAY_NOTHING))


def shown(message: str) -> str:
    """The beginning of a message, without paths of this machine."""
    said = re.sub(rf"{re.escape(str(KEPT))}/(models/)?|scene scene\.toml, ", "", message)
    return plain(said if len(said) <= LONGEST else f"{said[:LONGEST]} ...")


def main() -> int:
    """Try the models; 1 when one that plain MuJoCo loads passes `check` and does not run."""
    parser = argparse.ArgumentParser(description="Run models that nobody here made.")
    parser.add_argument("--wheels", type=Path, default=KEPT / "wheels", help="where wheels lie")
    parser.add_argument("--only", default="", help="part of the paths of the models to try")
    given = parser.parse_args()
    KEPT.mkdir(parents=True, exist_ok=True)
    found = outcomes(fetched(given.wheels), given.only)
    made = page(found)
    print(made)
    if not given.only:
        PAGE.write_text(with_part(PAGE.read_text("utf-8"), "strangers", made), "utf-8")
    return int(any(one.ran for one in found))


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit("stopped; `make strangers` goes on")
