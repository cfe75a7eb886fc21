"""Runs of the cases of a tier in parallel processes, without those that the report has."""

from __future__ import annotations

import multiprocessing
import signal
import sys
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO, TypeVar

from threadpoolctl import threadpool_limits

from flowborne.machine import GRACE, cores, end_with_parent, kernel_threads
from flowborne_validation.case import Result, Tier
from flowborne_validation.cases import case, case_ids
from flowborne_validation.page import write_page
from flowborne_validation.report import add_to_report, already_there

Task = TypeVar("Task")
Answer = TypeVar("Answer")


@dataclass(frozen=True)
class Job:
    """A run of a case, and the number of threads of its kernels."""

    id: str
    tier: Tier
    threads: int

    @property
    def quick(self) -> bool:
        """Whether it is the shorter of the case's runs."""
        return self.tier is not case(self.id).full


def run_cases(
    ids: Sequence[str] | None,
    tier: Tier,
    on_result: Callable[[Result], None] | None = None,
    report: Path | None = None,
    stream: TextIO | None = None,
) -> list[Result]:
    """Run cases on all cores of the machine, each in a process with its share of them.

    A case that the report has already is not run again, see `already_there`. After an interruption
    every finished case is in the report.

    ids        of the cases; all of the tier when None
    on_result  called with every result as its case ends, and first with those in the report
    report     folder of the report, to which each case is added as it ends
    stream     for messages about the progress; stderr when None
    returns    all results, in the order of the list
    raises     ValueError for a case that is not in the tier, or when the folder has another
               report.json; OSError when it cannot be written
    """
    names = [name for name in case_ids() if ids is None or name in ids]
    tiers = {n: has for n in names if (has := case(n).tier_in(tier)) is not None}
    if ids is not None and len(tiers) < len(names):
        raise ValueError(_not_in(next(name for name in names if name not in tiers), tier))
    found = {} if report is None else already_there(report, tiers)
    progress = Progress(len(tiers), len(found), sys.stderr if stream is None else stream)
    show = on_result or (lambda result: None)
    for results in found.values():
        for result in results:
            show(result)
    try:
        for batch in batches([(n, tiers[n]) for n in tiers if n not in found]):
            for job, answer in side_by_side(measure, batch, cores(), progress.begun):
                results = answer or [case(job.id).broken(job.quick, "its process was killed")]
                found[job.id] = results
                if report is not None:
                    add_to_report(report, results, case_ids())
                for result in results:
                    show(result)
                progress.ended(job, results[0].seconds)
    finally:
        if report is not None and found:
            write_page(report)
    return [result for name in tiers for result in found[name]]


def batches(runs: Sequence[tuple[str, Tier]]) -> list[list[Job]]:
    """Jobs that may run in parallel, the longest tiers first; then, each alone on all cores, the
    jobs that measure seconds."""
    together = [run for run in runs if not case(run[0]).alone]
    share = max(1, cores() // max(1, len(together)))
    found = [
        [Job(n, t, share) for tier in reversed(Tier) for n, t in together if t is tier],
        *([Job(n, t, cores())] for n, t in runs if case(n).alone),
    ]
    return [batch for batch in found if batch]


def measure(job: Job) -> list[Result]:
    """Run a job, in a worker process."""
    with kernel_threads(job.threads):
        return case(job.id).run(job.quick)


class Progress:
    """Prints the number of cases, and the progress as each ends.

    total  number of cases
    known  number of those in the report already
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


def begin_worker() -> None:
    """Initialise a worker: BLAS on one thread, it ends with its parent, which handles Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # tasks clean up
    end_with_parent()
    threadpool_limits(limits=1, user_api="blas")


def worker() -> ProcessPoolExecutor:
    """A process that runs one task after the other."""
    return ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), begin_worker)


def side_by_side(
    function: Callable[[Task], Answer],
    tasks: Sequence[Task],
    workers: int,
    on_begin: Callable[[Task], None],
) -> Iterator[tuple[Task, Answer | None]]:
    """Run all tasks, started in their order, some at once; yields each as it ends.

    function  of a module that a new process can import; its exceptions are raised here
    on_begin  called with every task as it begins
    yields    (task, its answer); None where the process died, killed or out of memory
    """
    waiting, others = deque(tasks), set(multiprocessing.active_children())
    free = [worker() for _ in range(min(workers, len(tasks)))]
    busy: dict[Future[Answer], tuple[ProcessPoolExecutor, Task]] = {}
    try:
        while waiting or busy:
            while waiting and free:
                executor, task = free.pop(), waiting.popleft()
                busy[executor.submit(function, task)] = executor, task
                on_begin(task)
            for future in wait(busy, return_when=FIRST_COMPLETED).done:
                executor, task = busy.pop(future)
                free.append(executor)
                answer: Answer | None = None
                try:
                    answer = future.result()
                except BrokenProcessPool:
                    free[-1] = worker()
                yield task, answer
    finally:
        for executor in free:
            executor.shutdown()
        interrupted = set(multiprocessing.active_children()) - others
        for process in interrupted:
            process.terminate()
        for executor, _ in busy.values():
            executor.shutdown(wait=False)
        for process in interrupted:
            process.join(GRACE)
            process.kill()
            process.join()
