"""Running the cases of a tier, side by side and not twice."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

from flowborne.machine import cores, kernel_threads
from flowborne.validation import case, case_ids
from flowborne.validation.case import Result, Tier
from flowborne.validation.page import write_page
from flowborne.validation.report import add_to_report, already_there
from flowborne.validation.side_by_side import side_by_side


@dataclass(frozen=True)
class Job:
    """A run of a case, and the threads that its kernels may use."""

    id: str
    tier: Tier
    threads: int

    @property
    def quick(self) -> bool:
        """Whether it is the shorter one of the case's runs."""
        return self.tier is not case(self.id).full


def run_cases(
    ids: Sequence[str] | None,
    tier: Tier,
    on_result: Callable[[Result], None] | None = None,
    report: Path | None = None,
    stream: TextIO | None = None,
) -> list[Result]:
    """Run cases on all of the machine's cores, each in a process with its share of them.

    What is in the report already is not run again: `already_there` says what counts as the same.
    Interrupted, this leaves every finished case in the report.

    ids        which; every one that the tier has when None
    on_result  called with every result as its case ends, those already in the report first
    report     folder of the report that each case is put into as it ends
    stream     where it is said how far the run is; stderr when None
    returns    all results, in the order of the list
    raises     ValueError for a case that the tier has not, or when the folder holds something else;
               OSError when it cannot be written
    """
    names = [name for name in case_ids() if ids is None or name in ids]
    tiers = {n: has for n in names if (has := case(n).tier_in(tier)) is not None}
    if ids is not None and len(tiers) < len(names):
        raise ValueError(_not_in(next(name for name in names if name not in tiers), tier))
    found = {} if report is None else already_there(report, tiers)
    news = News(len(tiers), len(found), sys.stderr if stream is None else stream)
    show = on_result or (lambda result: None)
    for results in found.values():
        for result in results:
            show(result)
    try:
        for batch in batches([(n, tiers[n]) for n in tiers if n not in found]):
            for job, answer in side_by_side(measure, batch, cores(), news.begun):
                results = answer or [case(job.id).broken(job.quick, "its process was killed")]
                found[job.id] = results
                if report is not None:
                    add_to_report(report, results, case_ids())
                for result in results:
                    show(result)
                news.ended(job, results[0].seconds)
    finally:
        if report is not None and found:
            write_page(report)
    return [result for name in tiers for result in found[name]]


def batches(runs: Sequence[tuple[str, Tier]]) -> list[list[Job]]:
    """The jobs that may run beside each other, the longest tiers first; then, each by itself and on
    all cores, those that measure seconds."""
    together = [run for run in runs if not case(run[0]).alone]
    share = max(1, cores() // max(1, len(together)))
    found = [
        [Job(n, t, share) for tier in reversed(Tier) for n, t in together if t is tier],
        *([Job(n, t, cores())] for n, t in runs if case(n).alone),
    ]
    return [batch for batch in found if batch]


def measure(job: Job) -> list[Result]:
    """Run a job, in a worker's process."""
    with kernel_threads(job.threads):
        return case(job.id).run(job.quick)


class News:
    """Says how many cases there are, and then, as each ends, how far the run is.

    total  cases
    known  those of them that are in the report already
    """

    def __init__(self, total: int, known: int, stream: TextIO) -> None:
        self.total, self.done, self.stream = total, known, stream
        self.running: list[str] = []
        self._say(f"cases: {total}" + (f", {known} of them in the report already" if known else ""))

    def begun(self, job: Job) -> None:
        self.running.append(job.id)

    def ended(self, job: Job, seconds: float) -> None:
        self.running.remove(job.id)
        self.done += 1
        left = f"; still at {', '.join(self.running)}" if self.running else ""
        self._say(f"{self.done}/{self.total}  {job.id} took {seconds:.0f} s{left}")

    def _say(self, text: str) -> None:
        print(text, file=self.stream, flush=True)


def _not_in(name: str, tier: Tier) -> str:
    found = case(name)
    has = " and ".join(dict.fromkeys([found.quick.value, found.full.value]))
    return f"case {name} is not in the tier {tier.value}: it has {has}; name one by --tier"
