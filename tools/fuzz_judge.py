"""What becomes of a broken input: flowborne's commands on it, and what is wrong with their ends."""

from __future__ import annotations

import contextlib
import csv
import io
import math
import os
import random
import shutil
import signal
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryFile
from typing import NamedTuple

from flowborne.cli import main as cli
from fuzz_bases import Broken
from fuzz_changes import LONG, SECRET
from fuzz_folders import damage
from fuzz_python import NOISE

LONGEST = 1500
"""Most letters of a message."""

RAN, STOPPED, REFUSED = "ran", "stopped in one message", "refused in one message"
INTERRUPTED = "interrupted in one message"
WELL = (RAN, STOPPED, INTERRUPTED, REFUSED)

PATIENCE = 10.0
"""Seconds after which a run is interrupted, as by Ctrl-C, and seconds until it is once more."""

TOLD = (
    "warnings: ",
    "first frame after ",
    "frame ",
    "compiling",
    "drawing the film",
    "starting",
    NOISE,
)
"""How lines on stderr begin that are no messages."""

FILM = (
    *("size=[100000, 100000]", "size=[64, 1000000000]", "frames_per_second=1e-300", "stop=nan"),
    *("frames_per_second=1e9", "camera.distance=1e-300", "camera.distance=1e300", "start=1e300"),
    *("camera.position=[0, 0, 0]", "camera.orbit=1e300", "camera.follow=none", "background=x"),
    *("camera.target=[1e300, 0, 0]", "camera.lens=1", "field=dye", "size=x", f"field={LONG}"),
)
"""--set of `film` that ask for too much, or for nothing."""


class Outcome(NamedTuple):
    """What came of an input.

    verdict   one of WELL, or what is wrong
    messages  number of them
    detail    what was said
    """

    verdict: str
    messages: int
    detail: str


class Said(NamedTuple):
    """What a command left: its exit code, its lines on stderr, and its text on stdout."""

    code: int
    lines: list[str]
    out: str

    @property
    def messages(self) -> list[str]:
        return [line for line in self.lines if not line.startswith(TOLD)]


@contextlib.contextmanager
def interrupted() -> Iterator[None]:
    """Context that is interrupted when it lasts too long."""
    before = signal.signal(signal.SIGALRM, lambda *_: os.kill(os.getpid(), signal.SIGINT))
    signal.setitimer(signal.ITIMER_REAL, PATIENCE, PATIENCE)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


@contextlib.contextmanager
def stderr_into(lines: list[str]) -> Iterator[None]:
    """Context in which what Python and what libraries write on stderr is added to `lines`."""
    with TemporaryFile("w+", buffering=1, encoding="utf-8", errors="backslashreplace") as file:
        kept = os.dup(2)
        os.dup2(file.fileno(), 2)
        try:
            with contextlib.redirect_stderr(file):
                yield
        finally:
            os.dup2(kept, 2)
            os.close(kept)
            file.seek(0)
            lines += file.read().splitlines()


FAULT = "fault of flowborne"
"""In a message about an error that nothing should end with."""


def command(*arguments: str | Path) -> Said:
    """Run a command of flowborne in this process; a run that lasts too long is interrupted."""
    out, lines = io.StringIO(), list[str]()
    code: object = 0
    patience = interrupted() if arguments[0] == "run" else contextlib.nullcontext()
    with contextlib.redirect_stdout(out), stderr_into(lines), patience:
        try:
            cli.main([str(argument) for argument in arguments])
        except SystemExit as end:
            code = end.code
    return Said(code if isinstance(code, int) else 1, lines, out.getvalue())


def fault(said: Said, accepted: tuple[int, ...]) -> str:
    """What is wrong with how a command ended; "" when nothing is."""
    if said.code not in accepted:
        return f"exit code {said.code}"
    if said.code == 0:
        if not said.out.replace(NOISE, "").strip():
            return "ended with 0 and said nothing"
        return "said something and ended with 0" if said.messages else ""
    if not said.messages:
        return "not a word"
    if any(FAULT in line for line in said.messages):
        return "a fault of flowborne"
    if not all(line.startswith("flowborne: ") for line in said.messages):
        return "no message of flowborne's"
    if any(len(line) > LONGEST for line in said.messages):
        return "a message too long"
    if any(SECRET.decode() in line for line in said.messages):
        return "a message that repeats what stands in a stranger's file"
    return ""


def finite(history: Path, frames: int) -> bool:
    """Whether a history has a row of finite numbers for each frame; no objective is nan."""
    with open(history, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    cells = [cell for row in rows for cell in row.items()]
    try:
        sound = all(math.isfinite(float(v)) or name == "objective" for name, v in cells)
        return len(rows) == frames and sound
    except (TypeError, ValueError):
        return False


def judged_scene(rng: random.Random, broken: Broken, folder: Path) -> Outcome:
    """What becomes of a scene; the working directory is its folder."""
    scene = folder / "scene.toml"
    trust = ["--trust"] if any(name.endswith(".py") for name in broken.files) else []
    settings = [f"--set={setting}" for setting in broken.settings]
    checked = command("check", scene, *trust, *settings)
    wrong = fault(checked, (0, 2))
    if wrong or checked.code == 2:
        return Outcome(wrong or REFUSED, len(checked.messages), "\n".join(checked.lines))
    out = () if rng.random() < 0.2 else ("--out", "run")
    workers = "2" if rng.random() < 0.02 else "1"
    ran = command("run", scene, *settings, "--frames", "3", "--no-film", *out, "--workers", workers)
    detail = "\n".join(ran.lines)
    if ran.code == 2:
        return Outcome("check accepted what run refuses", len(ran.messages), detail)
    wrong = fault(ran, (0, 1, 3, 130))
    if not wrong and ran.code == 0:
        histories = list((folder / out[1] if out else folder / "runs").rglob("history.csv"))
        if len(histories) != 1:
            wrong = "no history where it should be"
        elif not finite(histories[0], 3):
            wrong = "numbers that are not finite"
        elif rng.random() < 0.03:
            film = command("film", histories[0].parent, "--out", "frame.png", "--set", "stop=0.05")
            wrong, detail = fault(film, (0, 2)), "film\n" + "\n".join(film.lines)
    ends = {0: RAN, 1: STOPPED, 3: STOPPED, 130: INTERRUPTED}
    return Outcome(wrong or ends[ran.code], len(ran.messages), detail)


def judged_folder(
    rng: random.Random, folder: Path, outside: Path, whole: Path, kept: Path
) -> Outcome:
    """What becomes of a damaged run folder beside its scene; the working directory holds both.

    whole  a run of the scene
    kept   folder for what takes long to make
    """
    shutil.copytree(whole, folder / "run")
    shutil.copytree(whole, outside, dirs_exist_ok=True)
    what = damage(rng, folder / "run", outside, kept)
    with surroundings_kept(folder) as changed:
        seen = _seen(rng, what)
    return Outcome(changed[0], seen.messages, seen.detail) if changed else seen


def _seen(rng: random.Random, what: str) -> Outcome:
    run = ("run", "scene.toml", "--out", "run", "--no-film")
    film = rng.choice((*["stop=0.05"] * len(FILM), *FILM))
    ending = rng.choice((".csv", ".csv", ".glb", ".vtkhdf", ".usda", ".bvh"))
    commands = [
        (*run, "--resume", "--frames", "4"),
        ("film", "run", "--out", "frame.png", "--set", film),
        ("export", "run", "--out", f"table{ending}"),
        (*run, "--replace", "--frames", "2"),
    ]
    seen = Outcome(RAN, 0, "")
    for arguments in rng.choice((commands[:3], commands[:1], commands[1:], commands[3:])):
        said = command(*arguments)
        wrong = fault(said, (0, 1, 2, 3, 130) if arguments[0] == "run" else (0, 2))
        ran = not wrong and said.code == 0 and arguments[0] == "run"
        if ran and not finite(Path("run") / "history.csv", int(arguments[-1])):
            wrong = "numbers that are not finite"
        detail = f"{what}: {' '.join(arguments)}\n" + "\n".join(said.lines)
        if wrong:
            return Outcome(wrong, len(said.messages), detail)
        if said.code:
            seen = Outcome(REFUSED, max(seen.messages, len(said.messages)), detail)
    return seen


def judged_character(broken: Broken, *, readable: bool) -> Outcome:
    """What becomes of a character; the working directory is its folder.

    readable  whether it may be: what is outside of its folder may not
    """
    names = [*broken.files, *broken.links]
    character = next(name for name in names if name.endswith((".glb", ".gltf", ".usda", ".usdc")))
    said = command("import", character, "--out", "made", *broken.settings)
    wrong = fault(said, (0, 2))
    detail = "\n".join(said.lines)
    if wrong or said.code:
        return Outcome(wrong or REFUSED, len(said.messages), detail)
    if not readable:
        return Outcome("a file outside of its folder was read", 0, said.out)
    checked = command("check", Path("made") / "box.toml", "--set", "domain.resolution=12")
    detail = "check\n" + "\n".join(checked.lines)
    verdict = fault(checked, (0, 2)) or (REFUSED if checked.code else RAN)
    return Outcome(verdict, len(checked.messages), detail)


@contextlib.contextmanager
def surroundings_kept(folder: Path) -> Iterator[list[str]]:
    """Context that adds what is wrong to its list when anything around a folder has changed."""
    found: list[str] = []
    before = _around(folder)
    yield found
    after = _around(folder)
    changed = sorted(name for name in before | after if before.get(name) != after.get(name))
    if changed:
        found.append(f"changed outside of its folder: {changed[0]}")


def _around(folder: Path) -> dict[str, bytes]:
    """Content of every file, and name of every folder, beside a folder and above it."""
    found: dict[str, bytes] = {}
    for place, folders, files in os.walk(folder.parents[2]):
        if folder.name in folders and Path(place) == folder.parent:
            folders.remove(folder.name)
        found |= {f"{place}/{name}": b"" for name in folders}
        found |= {f"{place}/{name}": (Path(place) / name).read_bytes() for name in files}
    return found
