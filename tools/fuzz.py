"""The attack: broken inputs by the thousand, each of which runs well or is refused in one message.

`make fuzz` gives every scene to `check`, and what that accepts to `run` for three frames; a damaged
run folder to `run --resume`, `run --replace`, `film` and `export`; a character to `import`. Each
attack has a seed of its own, which it prints; `make fuzz SEED=...` repeats one. The counts go into
docs/attack.md, and it ends with 1 when there was any other outcome. What went well is kept in
build/ by seed and not tried again after a stop; without that folder it begins anew.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import random
import resource
import secrets
import subprocess
import sys
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path
from queue import SimpleQueue
from tempfile import TemporaryDirectory

import fuzz_characters as characters
import fuzz_inputs as inputs
import fuzz_limits as limits
import fuzz_python as python
from fuzz_bases import Broken, bases
from fuzz_judge import (
    LONGEST,
    WELL,
    Outcome,
    command,
    judged_character,
    judged_folder,
    judged_scene,
    surroundings_kept,
)
from marked import with_part

PAGE = Path(__file__).parents[1] / "docs" / "attack.md"
KEPT = Path(__file__).parents[1] / "build" / "fuzz"

SECONDS = 300.0
"""Longest that an input may take."""

MEMORY = 8 << 30
"""Bytes that an input may ask for."""

RESIDENT = 6 << 30
"""Bytes of memory that it may fill, besides those of the process before it: 3,173 cells each way,
which a scene may have, take 3 GB before MEMORY ends them with a message."""

INPUTS_EACH = 500
"""Inputs that a process judges before another one takes its place."""

Make = Callable[[random.Random], Broken]

FOLDER, ELSEWHERE = "run folder", "character's buffer elsewhere"


def run_folder(rng: random.Random) -> Broken:
    """The scene of a run; its folder is damaged when it is judged."""
    return Broken(bases()["pendulum"])


SCENES: dict[str, tuple[Make, int]] = {
    "scene's values": (inputs.scene_value, 22),
    "scene's sizes": (inputs.scene_size, 15),
    "scene's text": (inputs.scene_text, 7),
    "scene's names": (inputs.scene_name, 4),
    "--set": (inputs.setting, 7),
    "model's values": (inputs.model_value, 10),
    "model's text": (inputs.model_text, 4),
    "clip": (inputs.clip_text, 6),
    "table": (inputs.table_text, 3),
    "mesh": (inputs.mesh_bytes, 2),
    "surface of flesh": (inputs.surface_bytes, 2),
    "mesh of flesh": (inputs.flesh_bytes, 2),
    "another kind of file": (inputs.stranger, 1),
    "too much work": (limits.work, 3),
    "endless file": (limits.endless, 1),
    "nested deep": (limits.nested, 1),
    "false claims": (limits.claimed, 1),
    "long names": (limits.long_name, 1),
    FOLDER: (run_folder, 8),
}
"""What is broken -> how, and how often in a hundred."""

PARTS: dict[str, tuple[Make, int]] = {
    "part of one's own": (python.part, 30),
    "character's tree": (characters.tree, 22),
    "character's numbers": (characters.values, 10),
    "character's nodes": (characters.graph, 8),
    "character's claims": (characters.claim, 6),
    "character's address": (characters.address, 2),
    ELSEWHERE: (characters.elsewhere, 2),
    "character nested deep": (characters.nested, 2),
    "character's bytes": (characters.glb_bytes, 6),
    "character of USD": (characters.usd, 9),
    "endless character": (characters.endless, 1),
    "options of import": (characters.option, 2),
}
"""The same for `import` and for parts in Python."""

COUNTS = {"scenes": (SCENES, 20_000), "parts": (PARTS, 5_000)}
"""Campaign -> what it breaks, and how many inputs it has."""


def drawn(campaign: str, number: int, seed: str) -> tuple[str, random.Random]:
    """What is broken in an input, and the numbers at random of which it is made."""
    rng = random.Random(f"{seed}/{campaign}/{number}")
    makers = COUNTS[campaign][0]
    return rng.choices(list(makers), [often for _, often in makers.values()])[0], rng


def attack(campaign: str, number: int, seed: str) -> tuple[str, Outcome]:
    """What is broken in an input, and what comes of it."""
    kind, rng = drawn(campaign, number, seed)
    try:
        return kind, _outcome(kind, COUNTS[campaign][0][kind][0](rng), rng)
    except BaseException as error:
        told = traceback.format_exc()[-LONGEST:]
        return kind, Outcome(f"traceback: {type(error).__name__}", 0, told)


def _outcome(kind: str, broken: Broken, rng: random.Random) -> Outcome:
    with (
        TemporaryDirectory(prefix="flowborne-fuzz-", ignore_cleanup_errors=True) as work,
        warnings.catch_warnings(),
        _imports_undone(),
    ):
        warnings.simplefilter("always")
        folder, outside = Path(work) / "a" / "b" / "input", Path(work) / "a" / "b" / "outside"
        for place in (folder, outside):
            place.mkdir(parents=True)
        (outside / "canary.txt").write_text("alive")
        if kind == ELSEWHERE:
            (outside / "box.bin").write_bytes(characters.sound_buffer())
        broken.write(folder, outside)
        with contextlib.chdir(folder):
            if kind == FOLDER:
                return judged_folder(rng, folder, outside, _finished_run(), KEPT)
            with surroundings_kept(folder) as changed:
                if "scene.toml" in broken.files:
                    found = judged_scene(rng, broken, folder)
                else:
                    found = judged_character(broken, readable=kind != ELSEWHERE)
        return Outcome(changed[0], found.messages, found.detail) if changed else found


@contextlib.contextmanager
def _imports_undone() -> Iterator[None]:
    """Context after which Python knows no module that a scene has brought."""
    from flowborne.scenes import plugins

    known, path = set(sys.modules), list(sys.path)
    yield
    for name in set(sys.modules) - known:
        if name.startswith("part_"):
            del sys.modules[name]
    plugins.LOADED.clear()
    sys.path[:] = path


_kept: list[TemporaryDirectory[str]] = []


@cache
def _finished_run() -> Path:
    """A run of the pendulum, made once."""
    _kept.append(TemporaryDirectory(prefix="flowborne-fuzz-run-"))
    folder = Path(_kept[0].name)
    Broken(bases()["pendulum"]).write(folder, folder)
    said = command("run", folder / "scene.toml", "--no-film", "--out", folder / "run")
    if not (folder / "run").is_dir():
        raise RuntimeError(f"the run that is damaged was not made: {said}")
    return folder / "run"


def serve() -> None:
    """Judge the inputs that come on standard input, a line of JSON for each."""
    out = os.fdopen(os.dup(sys.stdout.fileno()), "w")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    for line in sys.stdin:
        Path("/proc/self/clear_refs").write_text("5")
        before = _resident("VmRSS")
        kind, outcome = attack(*json.loads(line))
        if (filled := _resident("VmHWM") - before) > RESIDENT:
            outcome = Outcome(f"fills {filled >> 30} GB of memory", 0, outcome.detail)
        print(json.dumps([kind, *outcome]), file=out, flush=True)


def _resident(field: str) -> int:
    """Bytes of memory that this process fills, VmRSS, or the most since it was asked to begin
    anew, VmHWM."""
    status = Path("/proc/self/status").read_text()
    return int(status.partition(f"{field}:")[2].split()[0]) << 10


class Worker:
    """A process that judges one input after the other, and is begun anew when one ends it."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[str] | None = None
        self._judged = 0

    def judge(self, campaign: str, number: int, seed: str) -> tuple[str, Outcome]:
        """What is broken, and what comes of it."""
        if self._judged == INPUTS_EACH:
            self.close()
        if self._process is None:
            self._judged = 0
            self._process = subprocess.Popen(
                [sys.executable, __file__, "--serve"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                text=True,
            )
        self._judged += 1
        process = self._process
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(json.dumps([campaign, number, seed]) + "\n")
        process.stdin.flush()
        with ThreadPoolExecutor(1) as waiting:
            answer = waiting.submit(process.stdout.readline)
            try:
                line = answer.result(SECONDS)
            except TimeoutError:
                process.kill()
                line, wrong = "", f"no end in {SECONDS:g} s"
            else:
                wrong = "" if line else f"the process ended with {process.wait()}"
        if wrong:
            self.close()
            return drawn(campaign, number, seed)[0], Outcome(wrong, 0, "")
        kind, *outcome = json.loads(line)
        return kind, Outcome(*outcome)

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._process = None


def outcomes(
    campaign: str, numbers: Sequence[int], seed: str, processes: int
) -> Iterator[tuple[int, str, Outcome]]:
    """Number, what is broken, and what came of each input, as they come."""
    workers = [Worker() for _ in range(processes)]
    idle: SimpleQueue[Worker] = SimpleQueue()
    for worker in workers:
        idle.put(worker)

    def work(number: int) -> tuple[int, str, Outcome]:
        worker = idle.get()
        try:
            return number, *worker.judge(campaign, number, seed)
        finally:
            idle.put(worker)

    try:
        with ThreadPoolExecutor(processes) as pool:
            yield from pool.map(work, numbers)
    finally:
        for worker in workers:
            worker.close()


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


def attacked(campaign: str, count: int, seed: str, processes: int) -> Counter[tuple[str, str]]:
    """Attack with so many inputs: how often each kind had each outcome."""
    kept = KEPT / f"{seed}-{campaign}.jsonl"
    found = went_well(kept)
    kept.parent.mkdir(parents=True, exist_ok=True)
    left = [number for number in range(count) if number not in found]
    with kept.open("a", encoding="utf-8") as file:
        for number, kind, outcome in outcomes(campaign, left, seed, processes):
            found[number] = kind, outcome
            if outcome.verdict in WELL:
                print(json.dumps([number, kind, *outcome]), file=file, flush=True)
            else:
                told = f"{seed}/{campaign}/{number}  {kind}  {outcome.verdict}"
                print(f"{told}\n{outcome.detail}\n", flush=True)
            if len(found) % 500 == 0:
                print(f"{len(found)} of {count}", file=sys.stderr, flush=True)
    judged = (found[number] for number in range(count))
    return Counter((kind, outcome.verdict) for kind, outcome in judged)


def main() -> int:
    """Run the campaigns; the exit code."""
    parser = argparse.ArgumentParser(description="Attack flowborne with broken inputs.")
    parser.add_argument("--seed", default="", help="repeat the attack of this seed")
    parser.add_argument("--share", type=float, default=1.0, help="part of all inputs to try")
    parser.add_argument("--processes", type=int, default=len(os.sched_getaffinity(0)))
    given = parser.parse_args()
    seed = given.seed or secrets.token_hex(4)
    print(f"seed {seed}", flush=True)
    tables, wrong = [], False
    for campaign, (_, count) in COUNTS.items():
        counts = attacked(campaign, round(given.share * count), seed, given.processes)
        tables.append(table(counts))
        print(tables[-1], flush=True)
        wrong |= any(verdict not in WELL for _, verdict in counts)
    if given.share == 1.0:
        made = "\n".join([f"Seed `{seed}`.\n", *tables])
        PAGE.write_text(with_part(PAGE.read_text("utf-8"), "fuzz", made), "utf-8")
    return int(wrong)


if __name__ == "__main__":
    if sys.argv[1:] == ["--serve"]:
        serve()
    else:
        try:
            sys.exit(main())
        except KeyboardInterrupt:
            sys.exit("stopped; `make fuzz SEED=...` with its seed goes on")
