"""The attack: broken inputs by the thousand, each of which runs well or is refused in one message.

`make fuzz` gives every input to `check`, and what it accepts to `run` for three frames; with a run
folder it is `run --resume`, `film` and `export`. It writes the counts into docs/attack.md, and ends
with 1 when there was any other outcome. What went well is kept in build/ and not tried again when
it was stopped, or when faults that it found are mended; without that folder it begins anew.
"""

from __future__ import annotations

import contextlib
import csv
import io
import json
import math
import os
import random
import resource
import shutil
import subprocess
import sys
import traceback
import warnings
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from flowborne import cli
from fuzz_bases import bases
from fuzz_inputs import SECRET, make, torn
from marked import with_part

PAGE = Path(__file__).parents[1] / "docs" / "attack.md"
KEPT = Path(__file__).parents[1] / "build" / "fuzz"

INPUTS, SEED = 20_000, "flowborne"

FOLDERS = 0.1
"""Part of the inputs that are run folders."""

SECONDS = 120.0
"""Longest that an input may take."""

MEMORY = 8 << 30
"""Bytes that an input may ask for."""

LONGEST = 1500
"""Most letters of a message."""

RAN, STOPPED, REFUSED = "ran", "stopped in one message", "refused in one message"
WELL = (RAN, STOPPED, REFUSED)

TOLD = (
    "first frame after ",
    "frame ",
    "compiling",
    "drawing the film",
    "starting",
    "warnings: ",
)
"""How lines on stderr begin that are no messages."""


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
    """What a command left: its exit code, and its lines on stderr."""

    code: int
    lines: list[str]

    @property
    def messages(self) -> list[str]:
        return [line for line in self.lines if not line.startswith(TOLD)]


def command(*arguments: str | Path) -> Said:
    """Run a command of flowborne in this process."""
    out, err = io.StringIO(), io.StringIO()
    code: object = 0
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            cli.main([str(argument) for argument in arguments])
        except SystemExit as end:
            code = end.code
    return Said(code if isinstance(code, int) else 1, err.getvalue().splitlines())


def fault(said: Said, accepted: tuple[int, ...]) -> str:
    """What is wrong with how a command ended; "" when nothing is."""
    if said.code not in accepted:
        return f"exit code {said.code}"
    if said.code == 0:
        return "said something and ended with 0" if said.messages else ""
    if not said.messages:
        return "not a word"
    if not all(line.startswith("flowborne: ") for line in said.messages):
        return "no message of flowborne's"
    if any(len(line) > LONGEST for line in said.messages):
        return "a message too long"
    if any(SECRET.decode() in line for line in said.messages):
        return "a message that repeats what stands in a stranger's file"
    return ""


def finite(history: Path) -> bool:
    """Whether a history has three rows of finite numbers; without a controller no objective."""
    with open(history, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    numbers = [float(v) for row in rows for name, v in row.items() if name != "objective"]
    return len(rows) == 3 and all(map(math.isfinite, numbers))


def judged(scene: Path) -> Outcome:
    """What becomes of a scene."""
    out = scene.parent / "run"
    checked = command("check", scene)
    wrong = fault(checked, (0, 2))
    if wrong or checked.code == 2:
        return Outcome(wrong or REFUSED, len(checked.messages), "\n".join(checked.lines))
    ran = command("run", scene, "--frames", "3", "--no-film", "--out", out, "--workers", "1")
    detail = "\n".join(ran.lines)
    if ran.code == 2:
        return Outcome("check accepted what run refuses", len(ran.messages), detail)
    wrong = fault(ran, (0, 1, 3))
    if not wrong and ran.code == 0 and not finite(out / "history.csv"):
        wrong = "numbers that are not finite"
    return Outcome(wrong or (STOPPED if ran.code else RAN), len(ran.messages), detail)


def judged_folder(seed: str, folder: Path) -> Outcome:
    """What becomes of a run folder of which one file is torn."""
    rng = random.Random(seed)
    out, whole = folder / "run", _finished_run()
    shutil.copytree(whole, out)
    files = sorted(path for path in out.rglob("*") if path.is_file())
    torn_file = rng.choice(files)
    torn_file.write_bytes(torn(rng, torn_file.read_bytes()))
    seen = Outcome(RAN, 0, "")
    for arguments in (
        ("run", folder / "scene.toml", "--out", out, "--resume", "--frames", "4", "--no-film"),
        ("film", out, "--out", folder / "frame.png", "--set", "stop=0.05"),
        ("export", out, "--out", folder / "table.csv"),
    ):
        said = command(*arguments)
        wrong = fault(said, (0, 2, 3))
        detail = f"{torn_file.name}: {arguments[0]}\n" + "\n".join(said.lines)
        if wrong:
            return Outcome(wrong, len(said.messages), detail)
        if said.code:
            seen = Outcome(REFUSED, max(seen.messages, len(said.messages)), detail)
    return seen


def attack(number: int, seed: str) -> tuple[str, Outcome]:
    """What is broken in an input, and what comes of it."""
    own = f"{seed}/{number}"
    with TemporaryDirectory(prefix="flowborne-fuzz-") as work, warnings.catch_warnings():
        warnings.simplefilter("always")
        folder = Path(work)
        if random.Random(own).random() < FOLDERS:
            for name, content in bases()["pendulum"].items():
                (folder / name).write_bytes(content)
            return "run folder", judged_folder(own, folder)
        kind, _, files = make(own)
        for name, content in files.items():
            (folder / name).write_bytes(content)
        return kind, judged(folder / "scene.toml")


_kept: list[TemporaryDirectory[str]] = []


def _finished_run() -> Path:
    """A run of the pendulum, made once."""
    if not _kept:
        _kept.append(TemporaryDirectory(prefix="flowborne-fuzz-run-"))
        folder = Path(_kept[0].name)
        for name, content in bases()["pendulum"].items():
            (folder / name).write_bytes(content)
        command("run", folder / "scene.toml", "--no-film", "--out", folder / "run")
    return Path(_kept[0].name) / "run"


def serve() -> None:
    """Judge the inputs whose numbers come on standard input, a line of JSON for each."""
    out = os.fdopen(os.dup(sys.stdout.fileno()), "w")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    for line in sys.stdin:
        number, seed = json.loads(line)
        try:
            kind, outcome = attack(number, seed)
        except BaseException as error:
            told = traceback.format_exc()[-LONGEST:]
            kind, outcome = "?", Outcome(f"traceback: {type(error).__name__}", 0, told)
        print(json.dumps([kind, *outcome]), file=out, flush=True)


class Worker:
    """A process that judges one input after the other, and is begun anew when one ends it."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[str] | None = None

    def judge(self, number: int, seed: str) -> tuple[str, Outcome]:
        """What is broken, and what comes of it."""
        if self._process is None:
            self._process = subprocess.Popen(
                [sys.executable, __file__, "--serve"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                text=True,
            )
        process = self._process
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(json.dumps([number, seed]) + "\n")
        process.stdin.flush()
        with ThreadPoolExecutor(1) as waiting:
            answer = waiting.submit(process.stdout.readline)
            try:
                line = answer.result(SECONDS)
            except TimeoutError:
                process.kill()
                line = ""
        if line:
            kind, *outcome = json.loads(line)
            return kind, Outcome(*outcome)
        ended = process.wait()
        self._process = None
        return "?", Outcome(f"the process ended with {ended}", 0, "")

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()


def outcomes(
    numbers: Sequence[int], seed: str, processes: int
) -> Iterator[tuple[int, str, Outcome]]:
    """Number, what is broken, and what came of each input, as they come."""

    def work(some: Sequence[int]) -> list[tuple[int, str, Outcome]]:
        worker = Worker()
        try:
            return [(number, *worker.judge(number, seed)) for number in some]
        finally:
            worker.close()

    with ThreadPoolExecutor(processes) as pool:
        for found in pool.map(work, (numbers[n : n + 50] for n in range(0, len(numbers), 50))):
            yield from found


def went_well(file: Path) -> dict[int, tuple[str, Outcome]]:
    """What is kept of an earlier attack: what was broken and what came of it, by number."""
    lines = file.read_text("utf-8").splitlines() if file.is_file() else []
    return {number: (kind, Outcome(*rest)) for number, kind, *rest in map(json.loads, lines)}


def table(counts: Counter[tuple[str, str]]) -> str:
    """The counts in Markdown: what is broken down the rows, verdicts across."""
    others = sorted({verdict for _, verdict in counts} - set(WELL))
    verdicts = [*WELL, *others]
    lines = [f"| broken | {' | '.join(verdicts)} |", f"| --- |{' --- |' * len(verdicts)}"]
    kinds = sorted({kind for kind, _ in counts})
    for kind in kinds:
        row = " | ".join(str(counts[kind, verdict]) for verdict in verdicts)
        lines.append(f"| {kind} | {row} |")
    sums = " | ".join(str(sum(counts[k, v] for k in kinds)) for v in verdicts)
    return "\n".join([*lines, f"| all {sum(counts.values())} | {sums} |"]) + "\n"


def main(inputs: int, seed: str) -> int:
    """Attack with so many inputs; the exit code."""
    kept = KEPT / f"{seed}.jsonl"
    found = went_well(kept)
    kept.parent.mkdir(parents=True, exist_ok=True)
    left = [number for number in range(inputs) if number not in found]
    with kept.open("a", encoding="utf-8") as file:
        for number, kind, outcome in outcomes(left, seed, len(os.sched_getaffinity(0))):
            found[number] = kind, outcome
            if outcome.verdict in WELL:
                print(json.dumps([number, kind, *outcome]), file=file, flush=True)
            else:
                told = f"{seed}/{number}  {kind}  {outcome.verdict}"
                print(f"{told}\n{outcome.detail}\n", flush=True)
            if len(found) % 500 == 0:
                print(f"{len(found)} of {inputs}", file=sys.stderr, flush=True)
    judged = [found[number] for number in range(inputs)]
    counts = Counter((kind, outcome.verdict) for kind, outcome in judged)
    made = table(counts)
    print(made)
    several = sum(outcome.messages > 1 for _, outcome in judged)
    print(f"{several} were told more than one thing")
    if inputs == INPUTS:
        PAGE.write_text(with_part(PAGE.read_text("utf-8"), "fuzz", made), "utf-8")
    return int(any(verdict not in WELL for _, verdict in counts))


if __name__ == "__main__":
    if sys.argv[1:] == ["--serve"]:
        serve()
    else:
        given = [*sys.argv[1:], *(str(INPUTS), SEED)[len(sys.argv) - 1 :]]
        sys.exit(main(int(given[0]), given[1]))
